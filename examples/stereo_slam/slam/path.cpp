// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/path.hpp"

#include <stdexcept>

#include "stereo_slam/core/pose_estimate.hpp"

namespace stereo_slam {

Path::Path(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread,
           const SavedMap& loaded, MapUse use)
    : loops_(std::make_unique<AsyncLoopCloser>(camera, settings, loop_thread, loaded, use)) {
  if (loaded.keyframes.empty()) return;
  segment_ = SegmentState::in_loaded_map();
  global_map_ = GlobalMap(loaded);
}

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
  result.status = TrackingStatus::kLost;
  append({Pose::identity(), unknown_pose_covariance()}, false, error, result);
}

void Path::report_keyframe(FrameResult& result) const {
  result.relative_covariance = trajectory_.T_previous_reference().covariance;
  const PoseGaussian T_world_camera = in_world(PoseGaussian{}, result.calibration);
  result.T_world_camera.covariance = T_world_camera.covariance;
  if (trajectory_.tilt_of_reference()) result.T_world_camera.pose = T_world_camera.pose;
}

bool Path::correct_before(std::size_t frame) {
  const auto correction = loops_ ? loops_->correction_due(frame) : std::nullopt;
  if (correction) correct(*correction);
  return correction.has_value();
}

void Path::search_loops(const Keyframe& keyframe, const cv::Mat& left, const LensResidual& lens) {
  if (!loops_) return;
  loops_->add_keyframe(keyframe, left, lens,
                       segment_.localised() ? CorrectionDelay::kUsual : CorrectionDelay::kShort);
}

void Path::finish(const std::vector<MotionChange>& learned, const std::vector<FrameChange>& frames) {
  std::vector<KeyframeLink> links;
  const bool tilts = trajectory_.spread_levelling();
  if (!learned.empty()) {
    links = trajectory_.remeasure(learned, frames);
  } else if (tilts) {
    links = trajectory_.remeasure(std::vector<MotionChange>(trajectory_.reference()));
  }
  const auto correction = loops_ ? loops_->finish(links) : std::nullopt;
  if (correction) correct(*correction);
}

/// Moves the keyframes, and what is relative to them.
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

void Path::save(const LocalMap& local_map, SavedMap& map) const {
  if (!loops_) throw std::logic_error("a map without loop closure has no keyframes to save");
  map.points = global_map_.all(local_map, trajectory_, /*with_loaded=*/true);
  loops_->save(map);
}

}  // namespace stereo_slam
