// SPDX-License-Identifier: MIT
// The part of the SLAM that reports trajectory, covariances, map and loops.
#include "stereo_slam/local_map/landmark_tracks.hpp"
#include "stereo_slam/slam/slam.hpp"

namespace stereo_slam {

std::vector<PoseGaussian> Slam::trajectory() const { return path_.poses(calibration_error()); }

std::optional<InertialSummary> Slam::inertial() const {
  const InertialSummary& summary = motion_.inertial().summary();
  return summary.phase == InertialPhase::kNone ? std::nullopt : std::optional(summary);
}

std::vector<LandmarkTrack> Slam::landmark_tracks() const {
  if (path_.frames() == 0) return {};
  return tracks_in_view(local_map_.view(), posterior_.pose, path_.frames() - 1);
}

SavedMap Slam::saved_map() const {
  SavedMap map;
  const LearnedCameras cameras = right_camera_.learned();
  map.camera = cameras.camera;
  map.rectification = cameras.estimate;
  path_.save(local_map_, map);
  return map;
}

}  // namespace stereo_slam
