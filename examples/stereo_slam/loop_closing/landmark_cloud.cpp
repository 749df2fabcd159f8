// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/landmark_cloud.hpp"

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace stereo_slam {

LoadedLandmarks::LoadedLandmarks(const SavedMap& map) : stored_(map.points) {
  for (const auto& keyframe : map.keyframes) T_world_keyframe_.push_back(keyframe.T_world_keyframe.pose);
  positions_.reserve(stored_.size());
  for (const auto& point : stored_) {
    positions_.emplace_back(T_world_keyframe_[point.keyframe].inverse() * point.position_world);
  }
}

void LoadedLandmarks::correct(std::vector<Pose> T_world_keyframe) {
  if (T_world_keyframe.size() != T_world_keyframe_.size()) {
    throw std::invalid_argument(fmt::format("{} poses for {} keyframes of a loaded map",
                                            T_world_keyframe.size(), T_world_keyframe_.size()));
  }
  T_world_keyframe_ = std::move(T_world_keyframe);
}

std::vector<MapPoint> LoadedLandmarks::points() const {
  std::vector<MapPoint> points = stored_;
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].position_world = T_world_keyframe_[points[i].keyframe] * positions_[i];
  }
  return points;
}

void MergedLandmarks::add(const MapPoint& point) {
  const std::size_t next = points_.size();
  const std::size_t position =
      point.landmark == 0 ? next : position_of_.try_emplace(point.landmark, next).first->second;
  if (position == next) {
    points_.push_back(point);
    views_.push_back(1.0);
    return;
  }
  Vector3<double>& mean = points_[position].position_world;
  mean += (point.position_world - mean) / ++views_[position];
}

}  // namespace stereo_slam
