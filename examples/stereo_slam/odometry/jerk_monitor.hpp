// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

namespace stereo_slam {

/// Remembers for some frames that the measured motion jerked. It may be that a vehicle was taken for the
/// street then: for about a second, neither the velocity nor the static points are certain.
class JerkMonitor {
 public:
  /// Adds a frame.
  void add(bool jerk) { frames_since_jerk_ = jerk ? 0 : std::min(frames_since_jerk_ + 1, kDoubtfulFrames); }

  /// Whether there was no jerk for some frames.
  [[nodiscard]] bool steady() const noexcept { return frames_since_jerk_ == kDoubtfulFrames; }

 private:
  static constexpr int kDoubtfulFrames = 10;

  int frames_since_jerk_ = kDoubtfulFrames;
};

}  // namespace stereo_slam
