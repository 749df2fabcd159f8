// SPDX-License-Identifier: MIT
// The part of the SLAM that reports trajectory, covariances, map and loops.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "stereo_slam/local_map/landmark_tracks.hpp"
#include "stereo_slam/slam/slam.hpp"

namespace stereo_slam {

/// Calibration errors that no image shows are assumed to be proportional to the row offset, which images
/// show.
CalibrationError Slam::calibration_error() const {
  const auto& allowed = settings_.calibration;
  const double seen_px = rectification_.current().rms_offset_px().y();
  const double scale =
      std::hypot(allowed.scale_sigma, allowed.scale_sigma_per_px * seen_px, rectification_.scale_sigma());
  const double axes_px =
      std::hypot(allowed.principal_point_sigma_px, allowed.principal_point_per_px * seen_px);
  return {.scale_sigma = std::min(scale, kLargestCalibrationError),
          .axes_sigma_rad = std::min(axes_px / camera_.fx, kLargestCalibrationError),
          .common_error_rad = std::min(allowed.common_error_px / camera_.fx, kLargestCalibrationError)};
}

/// T_world_camera of the last frame, including the uncertainty due to the errors that all frames share.
PoseGaussian Slam::in_world(const PoseGaussian& T_keyframe_camera, const CalibrationError& error) const {
  const LinkedPose T_world_camera = trajectory_.in_world(T_keyframe_camera);
  return with_calibration_error(T_world_camera.with_common_error(error.common_error_rad), error);
}

std::vector<PoseGaussian> Slam::trajectory() const {
  const CalibrationError error = calibration_error();
  auto T_world_camera = trajectory_.poses(error.common_error_rad);
  for (auto& pose : T_world_camera) pose = with_calibration_error(pose, error);
  return T_world_camera;
}

std::vector<MapPoint> Slam::map_points() const {
  return global_map_.all(local_map_, trajectory_, segment_.any_localised());
}

const std::vector<MapPoint>& Slam::archived_map_points() {
  return global_map_.archived(local_map_, trajectory_, segment_.any_localised());
}

std::vector<LandmarkTrack> Slam::landmark_tracks() const {
  if (trajectory_.frames() == 0) return {};
  return tracks_in_view(local_map_.view(), posterior_.pose(), trajectory_.frames() - 1);
}

SavedMap Slam::saved_map() const {
  if (!loops_) throw std::logic_error("a map without loop closure has no keyframes to save");
  SavedMap map;
  map.camera = camera_;
  map.rectification = rectification_.estimate();
  map.points = global_map_.all(local_map_, trajectory_, /*with_loaded=*/true);
  loops_->save(map);
  return map;
}

std::vector<LoopEvent> Slam::loop_events() const {
  return loops_ ? loops_->events() : std::vector<LoopEvent>{};
}

std::optional<std::span<const LoopEvent>> Slam::loop_events_if_idle() const {
  return loops_ ? loops_->events_if_idle() : std::span<const LoopEvent>{};
}

std::size_t Slam::keyframe_memory_bytes() const { return loops_ ? loops_->memory_bytes() : 0; }

}  // namespace stereo_slam
