// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/path.hpp"

#include "stereo_slam/core/pose_estimate.hpp"

namespace stereo_slam {

void Path::append(const PoseGaussian& T_keyframe_camera, bool measured, const CalibrationError& error,
                  FrameResult& result) {
  trajectory_.append(T_keyframe_camera, measured);
  result.keyframe = trajectory_.reference_frame();
  result.segment = segment_.current();
  result.relative_covariance = T_keyframe_camera.covariance;
  result.calibration = error;
  result.T_world_camera = in_world(T_keyframe_camera, error);
  result.T_odometry_camera = trajectory_.in_odometry_frame(T_keyframe_camera.pose);
}

void Path::append_unknown(const CalibrationError& error, FrameResult& result) {
  constexpr double kRotation_rad = 1.0;
  constexpr double kTranslation_m = 100.0;
  Vector6<double> sigma;
  sigma << Vector3<double>::Constant(kRotation_rad), Vector3<double>::Constant(kTranslation_m);
  result.status = TrackingStatus::kLost;
  append({Pose::identity(), sigma.cwiseAbs2().asDiagonal()}, false, error, result);
}

void Path::report_keyframe(FrameResult& result) const {
  result.relative_covariance = trajectory_.T_previous_reference().covariance;
  result.T_world_camera.covariance = in_world(PoseGaussian{}, result.calibration).covariance;
}

void Path::correct(const LoopCorrection& correction) {
  segment_.correct(correction.segment_localised);
  trajectory_.correct(correction.T_world_keyframe);
  global_map_.correct(correction);
}

std::vector<PoseGaussian> Path::poses(const CalibrationError& error) const {
  auto T_world_camera = trajectory_.poses(error.common_error_rad);
  for (auto& pose : T_world_camera) pose = with_calibration_error(pose, error);
  return T_world_camera;
}

/// T_world_camera of the last frame, including the uncertainty due to the errors that all frames share.
PoseGaussian Path::in_world(const PoseGaussian& T_keyframe_camera, const CalibrationError& error) const {
  const LinkedPose T_world_camera = trajectory_.in_world(T_keyframe_camera);
  return with_calibration_error(T_world_camera.with_common_error(error.common_error_rad), error);
}

}  // namespace stereo_slam
