// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "simulator/rendering/projection.hpp"

namespace stereo_slam::simulator {

inline constexpr int kTileSize_px = 16;
inline constexpr std::uint32_t kNoFace = std::numeric_limits<std::uint32_t>::max();

/// Offset of a sample from the centre of its pixel.
struct SampleOffset {
  float x = 0.0F;
  float y = 0.0F;
};

/// Sample positions in a pixel: one in every row and in every column of a Samples x Samples grid, so that the
/// nearly horizontal or vertical edges, frequent in streets, are resolved to 1/Samples of a pixel.
template <int Samples>
[[nodiscard]] constexpr std::array<SampleOffset, Samples> sample_pattern();

/// The face visible at every sample of a square of pixels.
template <int Samples>
struct Tile {
  static constexpr std::size_t kPixels = kTileSize_px * kTileSize_px;
  int first_column = 0;
  int first_row = 0;
  std::array<float, kPixels> farthest;  ///< smallest inverse depth of each pixel's samples
  std::array<std::array<float, Samples>, kPixels> inverse_depth;
  std::array<std::array<std::uint32_t, Samples>, kPixels> face;
};

/// Determines which of the faces `listed` (indices into `faces`) is visible at each sample.
template <int Samples>
void rasterize(Tile<Samples>& tile, std::span<const ScreenFace> faces, std::span<const std::uint32_t> listed);

template <>
constexpr std::array<SampleOffset, 4> sample_pattern<4>() {
  constexpr float k = 1.0F / 8.0F;
  return {{{-1 * k, -3 * k}, {3 * k, -1 * k}, {-3 * k, 1 * k}, {1 * k, 3 * k}}};
}

template <>
constexpr std::array<SampleOffset, 8> sample_pattern<8>() {
  constexpr float k = 1.0F / 16.0F;
  return {{{1 * k, -3 * k},
           {-1 * k, 3 * k},
           {5 * k, 1 * k},
           {-3 * k, -5 * k},
           {-5 * k, 5 * k},
           {-7 * k, -1 * k},
           {3 * k, 7 * k},
           {7 * k, -7 * k}}};
}

template <>
constexpr std::array<SampleOffset, 16> sample_pattern<16>() {
  constexpr float k = 1.0F / 32.0F;
  return {{{3 * k, 3 * k},
           {-1 * k, -5 * k},
           {-5 * k, 5 * k},
           {9 * k, -1 * k},
           {-9 * k, -3 * k},
           {5 * k, 11 * k},
           {11 * k, 7 * k},
           {7 * k, -9 * k},
           {-3 * k, 13 * k},
           {1 * k, -13 * k},
           {-7 * k, -11 * k},
           {-11 * k, 9 * k},
           {-15 * k, 1 * k},
           {15 * k, -7 * k},
           {13 * k, 15 * k},
           {-13 * k, -15 * k}}};
}

}  // namespace stereo_slam::simulator
