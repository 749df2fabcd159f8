// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <limits>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Number of differing bits, 0..256.
[[nodiscard]] int hamming_distance(const Descriptor& a, const Descriptor& b) noexcept;

/// The nearest of the descriptors that were offered, and the distance of the second nearest, in bits.
struct NearestDescriptor {
  std::size_t index = 0;
  int distance = std::numeric_limits<int>::max();
  int second = std::numeric_limits<int>::max();

  void offer(std::size_t candidate, int candidate_distance) {
    if (candidate_distance < distance) {
      second = distance;
      distance = candidate_distance;
      index = candidate;
    } else if (candidate_distance < second) {
      second = candidate_distance;
    }
  }
};

}  // namespace stereo_slam
