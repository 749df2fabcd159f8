// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "saved_map.hpp"
#include "types.hpp"

namespace stereo_slam {

/// Landmarks of an earlier run's map, each held by its keyframe.
class LoadedLandmarks {
 public:
  LoadedLandmarks() = default;
  explicit LoadedLandmarks(const SavedMap& map);

  /// Moves all of them with the keyframes of their map. Throws std::invalid_argument unless there is a pose
  /// for each.
  void correct(const std::vector<Pose>& T_world_keyframe);

  [[nodiscard]] const std::vector<MapPoint>& points() const noexcept { return points_; }

 private:
  std::vector<Vector3<double>> positions_;  // relative to their keyframes
  std::vector<MapPoint> points_;
  std::size_t keyframes_ = 0;
};

/// One point for all with the same number, the mean of them at the first one's place in the list. Points
/// without a number stay as they are.
[[nodiscard]] std::vector<MapPoint> merge_landmarks(const std::vector<MapPoint>& points);

}  // namespace stereo_slam
