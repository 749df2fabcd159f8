// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/odometry_covariance.hpp"

namespace stereo_slam {

PoseGaussian OdometryCovariance::next(const FrameResult& result) {
  const Pose T_map_odometry =
      (result.T_world_camera.pose * result.T_odometry_camera.inverse()).renormalized();
  const bool found_again = jumps(T_map_odometry, result);
  T_map_odometry_ = T_map_odometry;
  if (result.loop_corrected || found_again) is_map_ = false;

  if (found_again) {
    // The path goes on from the predicted pose, so the uncertainty of that remains.
    const Pose T_last_camera = last_.estimate.pose.inverse() * result.T_odometry_camera;
    T_odometry_reference_ = compose(last_, {T_last_camera, Matrix6<double>::Zero()});
  }
  last_ = relative_to_reference(result);
  const bool begins_map = result.keyframe == result.index;
  if (result.is_keyframe && !begins_map) T_odometry_reference_ = last_;

  if (is_map_) return {result.T_odometry_camera, result.T_world_camera.covariance};
  const PoseGaussian with_common_error = last_.with_common_error(result.calibration.common_error_rad);
  return {result.T_odometry_camera, with_calibration_error(with_common_error, result.calibration).covariance};
}

/// T_odometry_camera, by way of the reference keyframe. That of a keyframe is a link.
LinkedPose OdometryCovariance::relative_to_reference(const FrameResult& result) const {
  const Pose T_reference_camera =
      (T_odometry_reference_.estimate.pose.inverse() * result.T_odometry_camera).renormalized();
  const PoseGaussian relative = {T_reference_camera, result.relative_covariance};
  return result.is_keyframe ? add_link(T_odometry_reference_, relative)
                            : compose(T_odometry_reference_, relative);
}

/// Whether the camera was found again: the status says so, or the map moved in the odometry frame without a
/// loop correction, by more than rounding (metres or radians).
bool OdometryCovariance::jumps(const Pose& T_map_odometry, const FrameResult& result) const {
  constexpr double kRounding = 1e-6;
  if (result.status == TrackingStatus::kRelocalised) return true;
  if (result.loop_corrected) return false;
  return (T_map_odometry_.inverse() * T_map_odometry).log().norm() > kRounding;
}

}  // namespace stereo_slam
