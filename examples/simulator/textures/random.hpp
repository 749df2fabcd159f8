// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace stereo_slam::simulator {

/// Finaliser of SplitMix64 (Steele, Lea, Flood 2014): a bijection of 64-bit words that looks random.
[[nodiscard]] constexpr std::uint64_t mix_bits(std::uint64_t x) noexcept {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// SplitMix64 engine with its own distributions, so that a seed gives the same world with every standard
/// library.
class Random {
 public:
  constexpr explicit Random(std::uint64_t seed, std::uint64_t stream = 0) noexcept
      : state_(mix_bits(seed + kStep) ^ mix_bits(stream * kStep + 1)) {}

  constexpr std::uint64_t bits() noexcept { return mix_bits(state_ += kStep); }

  /// Uniform in [low, high).
  constexpr double uniform(double low, double high) noexcept {
    return low + (high - low) * static_cast<double>(bits() >> 11) * 0x1.0p-53;
  }
  constexpr double uniform() noexcept { return uniform(0.0, 1.0); }

  /// Uniform in 0 .. count - 1.
  constexpr std::size_t index(std::size_t count) noexcept { return static_cast<std::size_t>(bits() % count); }

  /// Uniform in low .. high, both included.
  constexpr int integer(int low, int high) noexcept {
    return low + static_cast<int>(index(static_cast<std::size_t>(high - low) + 1));
  }

  constexpr bool chance(double probability) noexcept { return uniform() < probability; }

  /// Standard normal (Box and Muller).
  double normal() noexcept {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

  /// An element of a container.
  template <class Container>
  constexpr const auto& pick(const Container& container) noexcept {
    return container[index(container.size())];
  }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15ULL;
  std::uint64_t state_;
};

}  // namespace stereo_slam::simulator
