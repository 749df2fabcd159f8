// SPDX-License-Identifier: MIT
#include "simulator/rendering/tile.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace stereo_slam::simulator {
namespace {

/// Number of faces after which the farthest sample of the tile is determined again.
constexpr int kFacesBetweenDepthChecks = 4;

/// Affine function in coordinates of the tile; small numbers, so single precision is exact enough.
template <int Samples>
struct LocalPlane {
  float dx = 0.0F;
  float dy = 0.0F;
  float origin = 0.0F;
  float reach = 0.0F;               ///< largest change between a pixel's centre and its border
  std::array<float, Samples> step;  ///< change between a pixel's centre and its samples

  LocalPlane() = default;
  LocalPlane(const ImagePlane& plane, int column, int row)
      : dx(static_cast<float>(plane.dx)),
        dy(static_cast<float>(plane.dy)),
        origin(static_cast<float>(plane(column, row))),
        reach(0.5F * (std::abs(dx) + std::abs(dy))) {
    constexpr auto kPattern = sample_pattern<Samples>();
    for (std::size_t s = 0; s < Samples; ++s) step[s] = dx * kPattern[s].x + dy * kPattern[s].y;
  }

  [[nodiscard]] float operator()(int column, int row) const {
    return dx * static_cast<float>(column) + dy * static_cast<float>(row) + origin;
  }
  /// Largest value inside the tile.
  [[nodiscard]] float largest() const {
    constexpr float kLast = kTileSize_px - 1;
    return origin + std::max(dx, 0.0F) * kLast + std::max(dy, 0.0F) * kLast + reach;
  }
};

/// Face prepared for one tile.
template <int Samples>
struct LocalFace {
  std::array<LocalPlane<Samples>, ScreenFace::kMaxEdges> edges;
  std::size_t edge_count = 0;
  LocalPlane<Samples> inverse_depth;

  LocalFace(const ScreenFace& face, int column, int row)
      : edge_count(static_cast<std::size_t>(face.edge_count)),
        inverse_depth(face.inverse_depth, column, row) {
    for (std::size_t e = 0; e < edge_count; ++e) edges[e] = {face.edges[e], column, row};
  }
};

/// Columns from begin up to, not including, end.
struct Span {
  int begin = 0;
  int end = 0;

  [[nodiscard]] bool contains(int column) const { return column >= begin && column < end; }

  /// Drops columns where dx column + value < 0. `keep_border`: whether to keep the column next to the zero.
  void clip(float dx, float value, bool keep_border) {
    if (dx == 0.0F) {
      if (value < 0.0F) end = begin;
      return;
    }
    constexpr float kFar = 1e6F;
    const int zero = static_cast<int>(std::clamp(-value / dx, -1.0F, kFar));
    if (dx > 0.0F) {
      begin = std::max(begin, keep_border ? zero : zero + 1);
    } else {
      end = std::min(end, keep_border ? zero + 1 : zero);
    }
  }
};

/// Samples of the pixel that fall into holes of the face get a negative margin. A place with opacity 0.5
/// covers half of the samples: every sample has its own threshold of opacity, in another order for each face.
template <int Samples>
void cut_holes(std::array<float, Samples>& margin, const ScreenFace& face, int column, int row) {
  if (face.inverse_depth(column, row) <= 0.0) return;  // a centre beyond the horizon of a face seen edge-on
  const float opacity = face.material->opacity->sample(
      footprint_at(face.u_over_depth, face.v_over_depth, face.inverse_depth, column, row));
  for (std::size_t s = 0; s < Samples; ++s) {
    const auto rank = static_cast<float>((s * 5 + face.sample_order) % Samples);
    margin[s] = std::min(margin[s], opacity * Samples - rank - 0.5F);
  }
}

/// Smallest value, by halving; Count is a power of two.
template <std::size_t Count>
[[nodiscard]] float smallest(std::array<float, Count> values) {
  for (std::size_t half = Count / 2; half > 0; half /= 2) {
    for (std::size_t i = 0; i < half; ++i) values[i] = std::min(values[i], values[i + half]);
  }
  return values[0];
}

template <int Samples>
void rasterize_face(Tile<Samples>& tile, const ScreenFace& face, const LocalFace<Samples>& local,
                    std::uint32_t id) {
  const Span columns{std::max(face.first_column - tile.first_column, 0),
                     std::min(face.last_column - tile.first_column + 1, kTileSize_px)};
  const int first_row = std::max(face.first_row - tile.first_row, 0);
  const int end_row = std::min(face.last_row - tile.first_row + 1, kTileSize_px);
  const bool has_holes = face.material->opacity != nullptr;

  for (int row = first_row; row < end_row; ++row) {
    Span touched = columns;  // some samples may be inside
    Span inner = columns;    // all samples are inside
    for (std::size_t e = 0; e < local.edge_count; ++e) {
      const LocalPlane<Samples>& edge = local.edges[e];
      const float value = edge(0, row);
      touched.clip(edge.dx, value + edge.reach, true);
      inner.clip(edge.dx, value - edge.reach, false);
    }
    for (int column = touched.begin; column < touched.end; ++column) {
      const auto pixel = static_cast<std::size_t>(row * kTileSize_px + column);
      const float centre = local.inverse_depth(column, row);
      if (centre + local.inverse_depth.reach <= tile.farthest[pixel]) continue;
      auto& depths = tile.inverse_depth[pixel];
      auto& ids = tile.face[pixel];
      std::array<float, Samples> margin;  // not negative where the face covers the sample
      margin.fill(1.0F);
      if (!inner.contains(column)) {
        for (std::size_t e = 0; e < local.edge_count; ++e) {
          const LocalPlane<Samples>& edge = local.edges[e];
          const float value = edge(column, row);
          for (std::size_t s = 0; s < Samples; ++s) margin[s] = std::min(margin[s], value + edge.step[s]);
        }
      }
      if (has_holes) {
        bool any = false;
        for (std::size_t s = 0; s < Samples; ++s) {
          any |= margin[s] >= 0.0F && centre + local.inverse_depth.step[s] > depths[s];
        }
        if (!any) continue;
        cut_holes<Samples>(margin, face, tile.first_column + column, tile.first_row + row);
      }
      for (std::size_t s = 0; s < Samples; ++s) {
        const float depth = centre + local.inverse_depth.step[s];
        const bool wins = depth > depths[s] && margin[s] >= 0.0F;
        depths[s] = wins ? depth : depths[s];
        ids[s] = wins ? id : ids[s];
      }
      tile.farthest[pixel] = smallest(depths);
    }
  }
}

}  // namespace

template <int Samples>
void rasterize(Tile<Samples>& tile, std::span<const ScreenFace> faces,
               std::span<const std::uint32_t> listed) {
  tile.farthest.fill(0.0F);
  for (auto& pixel : tile.inverse_depth) pixel.fill(0.0F);
  for (auto& pixel : tile.face) pixel.fill(kNoFace);
  float farthest_drawn = 0.0F;
  int drawn = 0;
  for (const std::uint32_t id : listed) {
    const ScreenFace& face = faces[id];
    const LocalPlane<Samples> inverse_depth(face.inverse_depth, tile.first_column, tile.first_row);
    if (inverse_depth.largest() <= farthest_drawn) continue;
    const LocalFace<Samples> local(face, tile.first_column, tile.first_row);
    rasterize_face(tile, face, local, id);
    if (++drawn % kFacesBetweenDepthChecks == 0) farthest_drawn = smallest(tile.farthest);
  }
}

template void rasterize<4>(Tile<4>&, std::span<const ScreenFace>, std::span<const std::uint32_t>);
template void rasterize<8>(Tile<8>&, std::span<const ScreenFace>, std::span<const std::uint32_t>);
template void rasterize<16>(Tile<16>&, std::span<const ScreenFace>, std::span<const std::uint32_t>);

}  // namespace stereo_slam::simulator
