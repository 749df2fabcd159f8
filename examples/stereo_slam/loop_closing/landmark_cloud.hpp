// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"

namespace stereo_slam {

/// Landmarks of an earlier run's map, each held by its keyframe.
class LoadedLandmarks {
 public:
  LoadedLandmarks() = default;
  explicit LoadedLandmarks(const SavedMap& map);

  /// Moves the keyframes of their map. Throws std::invalid_argument unless there is a pose for each.
  void correct(std::vector<Pose> T_world_keyframe);

  /// Where they are now.
  [[nodiscard]] std::vector<MapPoint> points() const;

 private:
  std::vector<MapPoint> stored_;            // as they were loaded
  std::vector<Vector3<double>> positions_;  // relative to their keyframes
  std::vector<Pose> T_world_keyframe_;
};

/// One point for all with the same number, the mean of them at the first one's place in the list. Points
/// without a number stay as they are.
[[nodiscard]] std::vector<MapPoint> merge_landmarks(const std::vector<MapPoint>& points);

}  // namespace stereo_slam
