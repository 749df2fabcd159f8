// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include <Eigen/Geometry>

#include "stereo_slam/evaluation/evaluate.hpp"

/// Whether two trajectories mean the same by a pose.
namespace stereo_slam {

/// How the poses of a file are to be changed before they mean T_world_body.
enum class PoseChange {
  kNone,
  kScalarLast,       ///< the quaternion was read with w first, and is written with w last
  kScalarFirst,      ///< the opposite
  kInverse,          ///< T_body_world is written
  kInverseRotation,  ///< R_body_world is written, and the position in the world
  kMirror,           ///< the axes are left-handed
};

/// A constant difference that remains between the poses of both files.
enum class FrameOffset {
  kNone,
  kOrigin,     ///< the bodies have other origins: a lever arm
  kBody,       ///< the bodies have other axes and origins
  kPositions,  ///< the positions of the estimate have other axes than its rotations
};

/// A hypothesis on the conventions, and how well the relative motions of both files agree with it.
struct ConventionFit {
  PoseChange change = PoseChange::kNone;
  bool of_truth = false;  ///< the ground truth is to be changed, not the estimate
  FrameOffset offset = FrameOffset::kNone;
  Eigen::Isometry3d T_truth_estimate = Eigen::Isometry3d::Identity();  ///< body to body, of kOrigin and kBody
  Eigen::Matrix3d axes =
      Eigen::Matrix3d::Identity();  ///< of the positions, of kPositions; may be a reflection
  double rotation_error = 0.0;      ///< root mean square, as a share of that of the motions
  double translation_error = 0.0;   ///< the same of the translations, after scaling
};

/// The conventions as they are, and the simplest ones that fit clearly better.
struct ConventionFinding {
  ConventionFit as_given;
  ConventionFit better;
  double ate_as_given_m = 0.0;  ///< SE(3)-aligned
  double ate_better_m = 0.0;
};

/// Compares the motions of both files over a fiftieth of the path under each hypothesis. A hypothesis fits
/// clearly better if the rotations or the translations agree three times as well, and neither worse. Nothing
/// if none does, or with fewer than ten motions.
[[nodiscard]] std::optional<ConventionFinding> find_conventions(const PosePairs& poses);

/// The poses after the change and the offset that a hypothesis assumes.
[[nodiscard]] PosePairs corrected(PosePairs poses, const ConventionFit& fit);

/// One sentence: what fits better, how much, and what to do.
[[nodiscard]] std::string describe(const ConventionFinding& finding);

}  // namespace stereo_slam
