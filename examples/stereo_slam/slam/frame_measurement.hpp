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

namespace stereo_slam {

/// A right image with the displacement that was found in it, and what the uncertainty of that adds to the
/// covariance of a motion.
struct SearchedRightImage {
  RightImageState image;
  Matrix6<double> pose_covariance = Matrix6<double>::Zero();
};

/// What the images of a frame show, seen with one displacement of the right image. Nothing of the SLAM's
/// state has changed yet, so that a frame can be measured with another one.
struct FrameMeasurement {
  RightImageState right;
  PointTracks tracks;  ///< the points of the odometry, followed into this frame
  OdometryResult odometry;
  PoseGaussian prior;          ///< T_keyframe_camera, predicted
  std::vector<Match> matches;  ///< landmarks found in this frame
  /// What the landmarks show of the displacement besides that of `right`.
  std::optional<DisplacementEstimate> displacement_left{};
  std::optional<InertialPrior> inertial{};  ///< what the prior rests on, if an IMU is used
  bool refutes_imu = false;  ///< more landmarks are where the odometry predicts them than by it
};

}  // namespace stereo_slam
