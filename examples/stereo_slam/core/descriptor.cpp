// SPDX-License-Identifier: MIT
#include "stereo_slam/core/descriptor.hpp"

namespace stereo_slam {
namespace {

#ifdef __x86_64__
/// differing_bits() with the popcnt instruction: several times as fast as the generic code.
[[gnu::target("popcnt")]] int differing_bits_popcnt(const Descriptor& a, const Descriptor& b) noexcept {
  return differing_bits(a, b);
}
#endif

}  // namespace

int hamming_distance(const Descriptor& a, const Descriptor& b) noexcept {
#ifdef __x86_64__
  static const bool has_popcnt = __builtin_cpu_supports("popcnt");
  if (has_popcnt) return differing_bits_popcnt(a, b);
#endif
  return differing_bits(a, b);
}

}  // namespace stereo_slam
