// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/local_map.hpp"
#include "stereo_slam/loop_closing/loop_closer.hpp"
#include "stereo_slam/loop_closing/map_ids.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/slam/keyframe_trajectory.hpp"

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

/// Landmarks of the whole run, and of the map that it started with, in world coordinates: one point a
/// landmark.
///
/// The points are computed when they are asked for: what was archived since the last time is added, and
/// everything is computed anew after a loop correction. Nothing here waits for the loop thread.
class GlobalMap {
 public:
  GlobalMap() = default;
  /// Starts with the landmarks of an earlier run.
  explicit GlobalMap(const SavedMap& loaded);

  /// Takes over the corrected poses of the loaded map's keyframes, and which landmarks loops have united.
  void correct(const LoopCorrection& correction);

  /// Archived landmarks; those of the loaded map too, if `with_loaded`.
  [[nodiscard]] const std::vector<MapPoint>& archived(const LocalMap& local_map,
                                                      const KeyframeTrajectory& trajectory, bool with_loaded);

  /// The archived landmarks and those that are still in the local map.
  [[nodiscard]] std::vector<MapPoint> all(const LocalMap& local_map, const KeyframeTrajectory& trajectory,
                                          bool with_loaded) const;

 private:
  [[nodiscard]] MergedLandmarks start(bool with_loaded) const;
  [[nodiscard]] MapPoint in_world(const ArchivedPoint& point, const KeyframeTrajectory& trajectory) const;

  MapIds ids_;
  LoadedLandmarks loaded_landmarks_;
  LandmarkIdentity identity_;
  MergedLandmarks merged_;    // the last result of archived()
  std::size_t archived_ = 0;  // number of points of the archive that merged_ contains
  bool with_loaded_ = false;  // whether merged_ contains the loaded map
  bool current_ = false;      // there was no correction since merged_ was computed
};

}  // namespace stereo_slam
