// SPDX-License-Identifier: MIT
#include "landmark_cloud.hpp"

#include <stdexcept>
#include <unordered_map>

#include <fmt/format.h>

namespace stereo_slam {

LoadedLandmarks::LoadedLandmarks(const SavedMap& map)
    : points_(map.points), keyframes_(map.keyframes.size()) {
  positions_.reserve(points_.size());
  for (const auto& point : points_) {
    const Pose& T_world_keyframe = map.keyframes[point.keyframe].T_world_keyframe.pose;
    positions_.emplace_back(T_world_keyframe.inverse() * point.position_world);
  }
}

void LoadedLandmarks::correct(const std::vector<Pose>& T_world_keyframe) {
  if (T_world_keyframe.size() != keyframes_) {
    throw std::invalid_argument(
        fmt::format("{} poses for {} keyframes of a loaded map", T_world_keyframe.size(), keyframes_));
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    points_[i].position_world = T_world_keyframe[points_[i].keyframe] * positions_[i];
  }
}

std::vector<MapPoint> merge_landmarks(const std::vector<MapPoint>& points) {
  std::vector<MapPoint> merged;
  std::vector<double> views;                                 // of each of them
  std::unordered_map<std::uint32_t, std::size_t> places_of;  // in them, of each landmark
  merged.reserve(points.size());
  for (const auto& point : points) {
    const auto next = merged.size();
    const auto place = point.landmark == 0 ? next : places_of.try_emplace(point.landmark, next).first->second;
    if (place == next) {
      merged.push_back(point);
      views.push_back(1.0);
    } else {
      Vector3<double>& mean = merged[place].position_world;
      mean += (point.position_world - mean) / ++views[place];
    }
  }
  return merged;
}

}  // namespace stereo_slam
