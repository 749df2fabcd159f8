// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/global_map.hpp"

#include <utility>

namespace stereo_slam {

GlobalMap::GlobalMap(const SavedMap& loaded) : ids_(extent_of(loaded)), loaded_landmarks_(loaded) {}

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
