// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stereo_slam/keyframes/keyframe.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"

namespace stereo_slam {

/// Converts the ids of a run to those of the map that it extends. In the map, the keyframes, segments, frames
/// and landmarks of the loaded map come first and keep their ids; those of the run follow. Without a loaded
/// map both ids are the same.
class MapIds {
 public:
  /// For a run that starts without a map.
  MapIds() = default;
  /// For a run that starts with a map of this extent; an empty one stands for none.
  explicit MapIds(const MapExtent& loaded) : loaded_(loaded) {}

  /// Number of keyframes of the loaded map: the id in the map of the run's first keyframe.
  [[nodiscard]] std::size_t first_keyframe_of_run() const noexcept { return loaded_.keyframes; }
  /// Number of segments of the loaded map: the id in the map of the run's first segment.
  [[nodiscard]] std::size_t first_segment_of_run() const noexcept { return loaded_.segments; }
  /// Whether a keyframe of the map, by its id there, comes from the loaded map.
  [[nodiscard]] bool is_loaded(std::size_t keyframe) const noexcept { return keyframe < loaded_.keyframes; }

  /// Id in the map of a keyframe of the run.
  [[nodiscard]] std::size_t keyframe_in_map(std::size_t id) const noexcept { return loaded_.keyframes + id; }
  /// Id in the map of a landmark of the run; 0, which stands for none, stays.
  [[nodiscard]] std::uint32_t landmark_in_map(std::uint32_t id) const noexcept {
    return id > 0 ? loaded_.landmarks + id : 0;
  }

  /// A keyframe of the run with its frame, its segment and its landmarks as the map counts them.
  [[nodiscard]] Keyframe in_map(Keyframe keyframe) const;

  /// Relative poses of the run's keyframes, with the ids of the keyframes in the map.
  [[nodiscard]] std::vector<KeyframeLink> in_map(std::vector<KeyframeLink> links) const;

  /// Index of the frame of a keyframe of the map: within the run, or within the loaded map for one of its
  /// keyframes.
  [[nodiscard]] std::size_t original_frame(const Keyframe& keyframe) const noexcept {
    return is_loaded(keyframe.id) ? keyframe.frame : keyframe.frame - loaded_.frames;
  }

 private:
  MapExtent loaded_;
};

}  // namespace stereo_slam
