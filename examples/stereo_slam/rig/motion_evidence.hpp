// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/rig/camera_errors.hpp"
#include "stereo_slam/rig/pair_geometry.hpp"
#include "stereo_slam/rig/seen_motion.hpp"

namespace stereo_slam {

/// How a measured motion depends on the errors of the cameras, and what its points show of them. Motions are
/// perturbed on the right, in rad and m.
struct MotionEvidence {
  using Derivative = Eigen::Matrix<double, 6, CameraErrors::kTerms>;

  Derivative derivative = Derivative::Zero();  ///< d motion / d coefficients
  /// d motion / d displacement of the second right image against the first
  Eigen::Matrix<double, 6, ImageDisplacement::kTerms> derivative_by_displacement =
      Eigen::Matrix<double, 6, ImageDisplacement::kTerms>::Zero();
  Vector6<double> derivative_by_delay =
      Vector6<double>::Zero();  ///< d motion / d delay of the right images, per s
  Matrix6<double> exposure_covariance =
      Matrix6<double>::Zero();  ///< of the motion, due to those until late right images were exposed
  CameraErrors::Coefficients applied = CameraErrors::Coefficients::Zero();  ///< when it was measured, px
  ImageDisplacement::Coefficients applied_displacement =
      ImageDisplacement::Coefficients::Zero();  ///< likewise
  double applied_delay_s = 0.0;                 ///< likewise
  ErrorTerms::EvidenceOfBoth evidence;  ///< what it shows of the coefficients and of that displacement
  bool vibrates = false;   ///< the right camera did: these coefficients held for this motion only
  std::size_t motion = 0;  ///< how many were measured before
  Matrix6<double> covariance = Matrix6<double>::Zero();  ///< of the motion, due to that of the coefficients
};

/// How the pose of a frame between two keyframes depends on the errors of the cameras. It was measured with
/// the same coefficients as the motion to the second keyframe. Single precision, since there are many.
struct FrameDependence {
  using Derivative = Eigen::Matrix<float, 6, CameraErrors::kTerms>;
  Derivative derivative = Derivative::Zero();  ///< d pose / d coefficients
  Vector6<float> derivative_by_delay =
      Vector6<float>::Zero();                          ///< d pose / d delay of the right images, per s
  Matrix6<float> covariance = Matrix6<float>::Zero();  ///< of the pose, due to that of the coefficients
};

/// The motion is eliminated, and so is a displacement of the second right image against the first if the rig
/// vibrates. If right images are late, it is a turn of the rig, and what is not known of the exposures is
/// eliminated as well. `applied` are the coefficients that the points were measured with. Nothing if the
/// points do not determine the motion.
[[nodiscard]] std::optional<MotionEvidence> evidence_of_motion(const SeenMotion& motion,
                                                               const PairGeometry& geometry,
                                                               const CameraErrors::Coefficients& applied,
                                                               const StereoCamera& camera, bool vibrates);

}  // namespace stereo_slam
