// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

namespace stereo_slam {

/// Parts of the map between losses of the camera. How a segment lies relative to the one before it is a
/// guess, until loops join them.
///
/// Segments are numbered as they begin. Those that loops have joined, directly or over others, have the same
/// root: the earliest of them.
class MapSegments {
 public:
  /// Begins a segment with this keyframe, later than all before. Throws std::invalid_argument if it is not.
  void begin(std::size_t first_keyframe);

  [[nodiscard]] std::size_t size() const noexcept { return roots_.size(); }
  [[nodiscard]] std::size_t first_keyframe(std::size_t segment) const { return first_keyframes_[segment]; }
  [[nodiscard]] std::size_t root(std::size_t segment) const { return roots_[segment]; }
  [[nodiscard]] bool joined(std::size_t a, std::size_t b) const { return root(a) == root(b); }
  /// Joined with the first segment, the one that the world's frame belongs to.
  [[nodiscard]] bool placed(std::size_t segment) const { return root(segment) == 0; }

  void join(std::size_t a, std::size_t b);

 private:
  std::vector<std::size_t> first_keyframes_;
  std::vector<std::size_t> roots_;
};

}  // namespace stereo_slam
