// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"

namespace stereo_slam {

/// Landmarks of a loaded map, relative to its keyframes.
class LoadedLandmarks {
 public:
  LoadedLandmarks() = default;
  explicit LoadedLandmarks(const SavedMap& map);

  /// Sets the poses of the loaded map's keyframes. Throws std::invalid_argument unless there is a pose for
  /// each.
  void correct(std::vector<Pose> T_world_keyframe);

  /// The landmarks at their current positions.
  [[nodiscard]] std::vector<MapPoint> points() const;

 private:
  std::vector<MapPoint> stored_;            // as they were loaded
  std::vector<Vector3<double>> positions_;  // relative to their keyframes
  std::vector<Pose> T_world_keyframe_;
};

/// Points of a map, one for each landmark: the mean of all points that were added with its id, at the index
/// of the first of them. Points without a landmark (id 0) stay as they are.
class MergedLandmarks {
 public:
  void add(const MapPoint& point);
  [[nodiscard]] const std::vector<MapPoint>& points() const noexcept { return points_; }

 private:
  std::vector<MapPoint> points_;
  std::vector<double> views_;                                   // number of points averaged in each point
  std::unordered_map<std::uint32_t, std::size_t> position_of_;  // index in points_, by landmark id
};

}  // namespace stereo_slam
