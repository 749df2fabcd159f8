// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Number of differing bits of two arrays of bytes. Inlined everywhere, so that a function that is compiled
/// for processors with popcnt uses that instruction.
template <std::size_t Bytes>
[[gnu::always_inline, nodiscard]] inline int differing_bits(
    const std::array<std::uint8_t, Bytes>& a, const std::array<std::uint8_t, Bytes>& b) noexcept {
  static_assert(Bytes % sizeof(std::uint64_t) == 0);
  int bits = 0;
  for (std::size_t i = 0; i < Bytes; i += sizeof(std::uint64_t)) {
    std::uint64_t x = 0;
    std::uint64_t y = 0;
    std::memcpy(&x, a.data() + i, sizeof x);
    std::memcpy(&y, b.data() + i, sizeof y);
    bits += std::popcount(x ^ y);
  }
  return bits;
}

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
