// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"

namespace stereo_slam {

/// Converts the ids of a run to those of the map that it extends. In the map, the keyframes, segments, frames
/// and landmarks of the loaded map come first and keep their ids; those of the run follow. Without a loaded
/// map both ids are the same.
struct MapIds {
  std::size_t keyframes = 0;    ///< of the loaded map: the id in the map of the run's first keyframe
  std::size_t segments = 0;     ///< of the loaded map: the id in the map of the run's first segment
  std::size_t frames = 0;       ///< of the loaded map
  std::uint32_t landmarks = 0;  ///< the largest landmark id of the loaded map

  /// For a run that starts with this map; an empty one stands for none.
  [[nodiscard]] static MapIds after(const SavedMap& map) {
    if (map.keyframes.empty()) return {};
    MapIds ids{.keyframes = map.keyframes.size(),
               .segments = map.keyframes.back().segment + 1,
               .frames = map.keyframes.back().frame + 1};
    for (const auto& keyframe : map.keyframes) {
      for (const auto& point : keyframe.points) ids.landmarks = std::max(ids.landmarks, point.landmark);
    }
    for (const auto& point : map.points) ids.landmarks = std::max(ids.landmarks, point.landmark);
    return ids;
  }

  /// Whether a keyframe of the map, by its id there, comes from the loaded map.
  [[nodiscard]] bool is_loaded(std::size_t keyframe) const noexcept { return keyframe < keyframes; }

  /// Id in the map of a keyframe of the run.
  [[nodiscard]] std::size_t keyframe_in_map(std::size_t id) const noexcept { return keyframes + id; }
  /// Id in the map of a landmark of the run; 0, which stands for none, stays.
  [[nodiscard]] std::uint32_t landmark_in_map(std::uint32_t id) const noexcept {
    return id > 0 ? landmarks + id : 0;
  }

  /// A keyframe of the run with its frame, its segment and its landmarks as the map counts them.
  [[nodiscard]] Keyframe in_map(Keyframe keyframe) const {
    keyframe.frame += frames;
    keyframe.segment += segments;
    for (auto& point : keyframe.points) point.landmark = landmark_in_map(point.landmark);
    return keyframe;
  }

  /// Index of the frame of a keyframe of the map: within the run, or within the loaded map for one of its
  /// keyframes.
  [[nodiscard]] std::size_t original_frame(const Keyframe& keyframe) const noexcept {
    return is_loaded(keyframe.id) ? keyframe.frame : keyframe.frame - frames;
  }
};
}  // namespace stereo_slam
