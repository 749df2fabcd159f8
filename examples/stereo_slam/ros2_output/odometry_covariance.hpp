// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The pose of the camera in the odometry frame, with a covariance that no loop reduces.
///
/// Until the first loop correction or relocalisation the odometry frame is the map, and the covariance is
/// that of T_world_camera. From then on the links between keyframes are composed without loops, as Path
/// composes them. While the camera is lost the covariance grows, and after a loss it keeps the uncertainty of
/// the predicted motion, which the odometry frame keeps as well.
class OdometryCovariance {
 public:
  /// Takes the next frame and returns T_odometry_camera of it. The frames are those of a run, in order, with
  /// poses of the camera and not of the body.
  [[nodiscard]] PoseGaussian next(const FrameResult& result);

 private:
  [[nodiscard]] LinkedPose relative_to_reference(const FrameResult& result) const;
  [[nodiscard]] bool jumps(const Pose& T_map_odometry, const FrameResult& result) const;

  LinkedPose T_odometry_reference_;  // of the keyframe that poses are relative to
  LinkedPose last_;                  // T_odometry_camera of the frame before
  Pose T_map_odometry_ = Pose::identity();
  bool is_map_ = true;  // the odometry frame is still the map
};

}  // namespace stereo_slam
