// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/global_map.hpp"

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

GlobalMap::GlobalMap(const SavedMap& loaded) : ids_(MapIds::after(loaded)), loaded_landmarks_(loaded) {}

void GlobalMap::correct(const LoopCorrection& correction) {
  loaded_landmarks_.correct(correction.T_world_loaded_keyframe);
  identity_ = correction.identity;
  current_ = false;
}

const std::vector<MapPoint>& GlobalMap::archived(const LocalMap& local_map,
                                                 const KeyframeTrajectory& trajectory, bool with_loaded) {
  if (!std::exchange(current_, true) || with_loaded_ != with_loaded) {
    merged_ = start(with_loaded);
    archived_ = 0;
    with_loaded_ = with_loaded;
  }
  const auto& archive = local_map.archive();
  for (; archived_ < archive.size(); ++archived_) merged_.add(in_world(archive[archived_], trajectory));
  return merged_.points();
}

std::vector<MapPoint> GlobalMap::all(const LocalMap& local_map, const KeyframeTrajectory& trajectory,
                                     bool with_loaded) const {
  MergedLandmarks merged = start(with_loaded);
  for (const auto& point : local_map.archive()) merged.add(in_world(point, trajectory));
  for (const auto& point : local_map.established()) merged.add(in_world(point, trajectory));
  return merged.points();
}

MergedLandmarks GlobalMap::start(bool with_loaded) const {
  MergedLandmarks merged;
  if (!with_loaded) return merged;
  for (auto& point : loaded_landmarks_.points()) {
    point.landmark = identity_(point.landmark);
    merged.add(point);
  }
  return merged;
}

MapPoint GlobalMap::in_world(const ArchivedPoint& point, const KeyframeTrajectory& trajectory) const {
  return {trajectory.T_world_keyframe(point.keyframe) * point.position, point.intensity,
          ids_.keyframe_in_map(point.keyframe), identity_(ids_.landmark_in_map(point.landmark))};
}

}  // namespace stereo_slam
