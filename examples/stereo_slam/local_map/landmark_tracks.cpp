// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/landmark_tracks.hpp"

namespace stereo_slam {

std::vector<LandmarkTrack> tracks_in_view(const MapView& map, const Pose& T_keyframe_camera,
                                          std::size_t frame) {
  std::vector<LandmarkTrack> tracks;
  for (const Landmark& landmark : map.landmarks) {
    const auto z = project(to_point(landmark, landmark.mean, map.camera), T_keyframe_camera, map.camera);
    if (!z || !(z->z() > 0.0) || !map.camera.in_view(*z)) continue;
    const bool found = landmark.last_seen == frame;
    tracks.push_back({.id = landmark.id,
                      .left_px = found ? landmark.last_px : Vector2<double>(z->head<2>()),
                      .depth_m = map.camera.fx * map.camera.baseline_m / z->z(),
                      .observations = landmark.observations,
                      .found = found});
  }
  return tracks;
}

}  // namespace stereo_slam
