// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

namespace stereo_slam {

/// Segments of the map: a loss of tracking begins a new one. Its pose relative to the segment before is a
/// guess until loops join the two.
///
/// The ids of segments count from 0. Segments that loops have joined, directly or over others, have the same
/// root: the earliest of them.
class MapSegments {
 public:
  /// Begins a segment with this keyframe. Throws std::invalid_argument unless it is later than the first
  /// keyframe of the segment before.
  void begin(std::size_t first_keyframe) {
    if (!first_keyframes_.empty() && first_keyframe <= first_keyframes_.back()) {
      throw std::invalid_argument(fmt::format("a segment begins with keyframe {}, the one before with {}",
                                              first_keyframe, first_keyframes_.back()));
    }
    roots_.push_back(roots_.size());
    first_keyframes_.push_back(first_keyframe);
  }

  [[nodiscard]] std::size_t size() const noexcept { return roots_.size(); }
  [[nodiscard]] std::size_t first_keyframe(std::size_t segment) const { return first_keyframes_[segment]; }
  [[nodiscard]] std::size_t root(std::size_t segment) const { return roots_[segment]; }
  [[nodiscard]] bool joined(std::size_t a, std::size_t b) const { return root(a) == root(b); }
  /// Whether it is joined with the first segment, which defines the world frame.
  [[nodiscard]] bool localised(std::size_t segment) const { return root(segment) == 0; }

  void join(std::size_t a, std::size_t b) {
    const auto [kept, replaced] = std::minmax({root(a), root(b)});
    std::replace(roots_.begin(), roots_.end(), std::size_t{replaced}, std::size_t{kept});
  }

 private:
  std::vector<std::size_t> first_keyframes_;
  std::vector<std::size_t> roots_;
};

}  // namespace stereo_slam
