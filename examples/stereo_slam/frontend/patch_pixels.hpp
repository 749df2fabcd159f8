// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace stereo_slam {

/// Four numbers in one register: an extension of GCC and Clang.
using FourFloats [[gnu::vector_size(4 * sizeof(float))]] = float;
using FourInts [[gnu::vector_size(4 * sizeof(std::int32_t))]] = std::int32_t;

[[nodiscard]] inline FourFloats load_four(const float* values) {
  FourFloats four;
  std::memcpy(&four, values, sizeof four);
  return four;
}

/// One number for each of the 7 x 7 pixels of a patch. A row fills two registers; its eighth number is zero.
struct PatchPixels {
  static constexpr std::size_t kSide = 7;
  static constexpr FourFloats kWithoutLast{1.0F, 1.0F, 1.0F, 0.0F};

  std::array<FourFloats, 2 * kSide> fours{};

  void set_row(std::size_t row, FourFloats first, FourFloats last) {
    fours[2 * row] = first;
    fours[2 * row + 1] = last * kWithoutLast;
  }

  void subtract(float factor, const PatchPixels& other) {
    for (std::size_t i = 0; i < fours.size(); ++i) fours[i] -= factor * other.fours[i];
  }

  void subtract_mean();
};

[[nodiscard]] inline float sum_of(FourFloats v) { return (v[0] + v[2]) + (v[1] + v[3]); }

/// Sum over the pixels.
[[nodiscard]] inline float sum_of(const PatchPixels& a) {
  FourFloats sum{};
  for (const FourFloats& four : a.fours) sum += four;
  return sum_of(sum);
}

/// Inner product over the pixels.
[[nodiscard]] inline float product(const PatchPixels& a, const PatchPixels& b) {
  FourFloats sum{};
  for (std::size_t i = 0; i < a.fours.size(); ++i) sum += a.fours[i] * b.fours[i];
  return sum_of(sum);
}

[[nodiscard]] inline PatchPixels combination(float p, const PatchPixels& a, float q, const PatchPixels& b) {
  PatchPixels result;
  for (std::size_t i = 0; i < result.fours.size(); ++i) result.fours[i] = p * a.fours[i] + q * b.fours[i];
  return result;
}

inline void PatchPixels::subtract_mean() {
  const float mean = sum_of(*this) / static_cast<float>(kSide * kSide);
  for (std::size_t row = 0; row < kSide; ++row)
    set_row(row, fours[2 * row] - mean, fours[2 * row + 1] - mean);
}

/// Eight grey values, converted to float.
struct EightFloats {
  FourFloats first, last;

  explicit EightFloats(const std::uint8_t* pixels) {
    using Bytes [[gnu::vector_size(16)]] = std::uint8_t;
    using Shorts [[gnu::vector_size(16)]] = std::uint16_t;
    using Ints [[gnu::vector_size(16)]] = std::int32_t;
    using Longs [[gnu::vector_size(16)]] = std::uint64_t;
    std::uint64_t eight = 0;
    std::memcpy(&eight, pixels, sizeof eight);
    const auto bytes = reinterpret_cast<Bytes>(Longs{eight, 0});
    static_assert(std::endian::native == std::endian::little);
    // Interleaving with zeros widens the bytes to 16 bits, and these to 32 bits.
    const auto shorts = reinterpret_cast<Shorts>(
        __builtin_shufflevector(bytes, Bytes{}, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23));
    const auto low = __builtin_shufflevector(shorts, Shorts{}, 0, 8, 1, 9, 2, 10, 3, 11);
    const auto high = __builtin_shufflevector(shorts, Shorts{}, 4, 12, 5, 13, 6, 14, 7, 15);
    first = __builtin_convertvector(reinterpret_cast<Ints>(low), FourFloats);
    last = __builtin_convertvector(reinterpret_cast<Ints>(high), FourFloats);
  }
};

}  // namespace stereo_slam
