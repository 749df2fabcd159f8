// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/inertial/inertial_filter.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/odometry/odometry.hpp"
#include "stereo_slam/odometry/point_tracks.hpp"
#include "stereo_slam/rig/displacement_estimation.hpp"
#include "stereo_slam/rig/right_camera.hpp"
#include "stereo_slam/tracking/update.hpp"

namespace stereo_slam {

/// What the images of a frame show, seen with one displacement of the right image. Nothing of the SLAM's
/// state has changed yet, so that a frame can be measured with another one.
struct FrameMeasurement {
  RightImageState right{};
  PointTracks tracks{};  ///< the points of the odometry, followed into this frame
  OdometryResult odometry{};
  PoseGaussian prior{};          ///< T_keyframe_camera, predicted
  std::vector<Match> matches{};  ///< landmarks found in this frame
  /// What the landmarks show of the displacement besides that of `right`.
  std::optional<DisplacementEstimate> displacement_left{};
  std::optional<InertialPrior> inertial{};  ///< what the prior rests on, if an IMU is used
  bool refutes_imu = false;  ///< more landmarks are where the odometry predicts them than by it
};

/// What the pose of a frame was measured against.
enum class PoseBasis {
  kNothing,    ///< predicted
  kImu,        ///< predicted by the readings of an IMU
  kOdometry,   ///< the previous frame alone
  kLandmarks,  ///< the landmarks of the reference keyframe too
  kKeyframe,   ///< the reference keyframe, recognised after a loss
};

/// One step of the filter: what a frame showed, and the pose relative to the reference keyframe that follows.
struct TrackedPose : FrameMeasurement {
  PoseUpdate update;         ///< of the prior by the landmarks
  bool by_keyframe = false;  ///< the keyframe was recognised after a loss, and gave the posterior

  [[nodiscard]] PoseBasis basis() const noexcept {
    if (by_keyframe) return PoseBasis::kKeyframe;
    if (update.converged) return PoseBasis::kLandmarks;
    if (odometry.valid) return PoseBasis::kOdometry;
    return inertial ? PoseBasis::kImu : PoseBasis::kNothing;
  }

  /// Whether the images of the frame measured it.
  [[nodiscard]] bool measured() const noexcept {
    return basis() != PoseBasis::kNothing && basis() != PoseBasis::kImu;
  }

  /// Whether landmarks measured the pose, but so few that they may agree by chance, as in images blurred by
  /// motion.
  [[nodiscard]] bool has_few_landmarks() const noexcept {
    constexpr std::size_t kFewMatches = 15;
    return basis() == PoseBasis::kLandmarks && matches.size() < kFewMatches;
  }

  /// Writes motion, matches and innovation into the result.
  void report(FrameResult& result) const {
    result.odometry = odometry.T_previous_current;
    result.matches = static_cast<int>(matches.size());
    result.nis = update.nis;
    result.nis_dof = update.nis_dof;
  }
};

}  // namespace stereo_slam
