// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace stereo_slam {

/// The map segment that the tracking is in, and whether its place in the map is known.
///
/// A new segment begins where the camera is lost and nothing is recognised; a loop localises it. In a loaded
/// map the first segment begins unlocalised too.
class SegmentState {
 public:
  SegmentState() = default;
  /// First segment of a run that starts with a loaded map.
  [[nodiscard]] static SegmentState in_loaded_map() {
    SegmentState state;
    state.localised_ = state.any_localised_ = false;
    return state;
  }

  /// Begins the next segment at a frame. Its place is a guess: a good one, with a covariance that holds, if
  /// it was `predicted` over a short gap from a segment whose place was known.
  void begin_next(std::size_t frame, bool predicted) {
    ++current_;
    first_frame_ = frame;
    predicted_ = predicted && (localised_ || predicted_);
    localised_ = newly_localised_ = false;
  }

  /// Takes what a loop correction says of every segment: its place is known.
  void correct(const std::vector<bool>& segment_localised) {
    const bool known = current_ < segment_localised.size() && segment_localised[current_];
    if (known && !std::exchange(localised_, true)) newly_localised_ = true;
    any_localised_ = any_localised_ || std::find(segment_localised.begin(), segment_localised.end(), true) !=
                                           segment_localised.end();
  }

  /// Id of the current segment.
  [[nodiscard]] std::size_t current() const noexcept { return current_; }
  [[nodiscard]] bool localised() const noexcept { return localised_; }
  /// Whether the place, if it is not known, is predicted well enough for the covariance to hold in a frame of
  /// the segment. What hid the scene may still be in view for some frames: of the wrong motions in traffic
  /// jams nine in ten are in the first thirty frames after a loss (docs/results/dynamic.md).
  [[nodiscard]] bool predicted(std::size_t frame) const noexcept {
    constexpr std::size_t kDoubtfulFrames = 30;
    return predicted_ && frame >= first_frame_ + kDoubtfulFrames;
  }
  /// Whether any segment of the run is localised: then the loaded map and the run share one world.
  [[nodiscard]] bool any_localised() const noexcept { return any_localised_; }
  /// True once after the current segment was localised.
  [[nodiscard]] bool take_newly_localised() { return std::exchange(newly_localised_, false); }

 private:
  std::size_t current_ = 0;
  std::size_t first_frame_ = 0;
  bool localised_ = true;
  bool predicted_ = false;
  bool newly_localised_ = false;
  bool any_localised_ = true;
};

}  // namespace stereo_slam
