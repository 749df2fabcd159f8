// SPDX-License-Identifier: MIT
#include "tile.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace stereo_slam::simulate {
namespace {

/// Depth buckets of a tile are searched again for the farthest sample after this many faces.
constexpr int kFacesBetweenDepthChecks = 12;

/// Affine function in coordinates of the tile; small numbers, so single precision is exact enough.
struct LocalPlane {
  float dx = 0.0F;
  float dy = 0.0F;
  float origin = 0.0F;
  float reach = 0.0F;  ///< largest change between a pixel's centre and its border

  [[nodiscard]] float operator()(float x, float y) const { return dx * x + dy * y + origin; }
};

[[nodiscard]] LocalPlane localize(const ImagePlane& plane, int column, int row) {
  return {static_cast<float>(plane.dx), static_cast<float>(plane.dy), static_cast<float>(plane(column, row)),
          static_cast<float>(0.5 * (std::abs(plane.dx) + std::abs(plane.dy)))};
}

/// Columns from begin up to, not including, end.
struct Span {
  int begin = 0;
  int end = 0;
};

/// Narrows the span to the columns where dx x + value >= 0.
void clip_span(Span& span, float dx, float value) {
  constexpr float kFar = 1e6F;
  if (dx > 0.0F) {
    span.begin = std::max(span.begin, static_cast<int>(std::ceil(std::clamp(-value / dx, -kFar, kFar))));
  } else if (dx < 0.0F) {
    span.end = std::min(span.end, static_cast<int>(std::floor(std::clamp(-value / dx, -kFar, kFar))) + 1);
  } else if (value < 0.0F) {
    span.end = span.begin;
  }
}

/// Face prepared for one tile.
struct LocalFace {
  std::array<LocalPlane, ScreenFace::kMaxEdges> edges;
  int edge_count = 0;
  LocalPlane inverse_depth;
};

[[nodiscard]] LocalFace localize(const ScreenFace& face, int column, int row) {
  LocalFace local;
  local.edge_count = face.edge_count;
  for (std::size_t i = 0; i < static_cast<std::size_t>(face.edge_count); ++i) {
    local.edges[i] = localize(face.edges[i], column, row);
  }
  local.inverse_depth = localize(face.inverse_depth, column, row);
  return local;
}

/// Largest value an affine function takes inside the tile.
[[nodiscard]] float largest(const LocalPlane& plane) {
  constexpr float kLast = kTileSize_px - 1;
  return plane.origin + std::max(plane.dx, 0.0F) * kLast + std::max(plane.dy, 0.0F) * kLast + plane.reach;
}

/// Texture coordinates of the samples of one pixel of a face with holes, and which samples its opacity lets
/// through.
template <int Samples>
void mask_holes(const ScreenFace& face, int column, int row, std::array<bool, Samples>& covered) {
  const Texture& opacity = *face.material->opacity;
  const Footprint footprint =
      footprint_at(face.u_over_depth, face.v_over_depth, face.inverse_depth, column, row);
  // One level finer than a pixel, as there are several samples in it.
  const int level = opacity.nearest_level(footprint) - 1;
  constexpr auto kPattern = sample_pattern<Samples>();
  for (std::size_t s = 0; s < Samples; ++s) {
    if (!covered[s]) continue;
    const double du = footprint.du_dx * static_cast<double>(kPattern[s].x) +
                      footprint.du_dy * static_cast<double>(kPattern[s].y);
    const double dv = footprint.dv_dx * static_cast<double>(kPattern[s].x) +
                      footprint.dv_dy * static_cast<double>(kPattern[s].y);
    // Blurred opacity becomes coverage: each sample has its own threshold, in another order for each face.
    const auto rank = static_cast<float>((s * 5 + face.sample_order) % Samples);
    covered[s] = opacity.sample_level(footprint.u + du, footprint.v + dv, level) * Samples > rank + 0.5F;
  }
}

template <int Samples>
void rasterize_face(Tile<Samples>& tile, const ScreenFace& face, const LocalFace& local, std::uint32_t id) {
  constexpr auto kPattern = sample_pattern<Samples>();
  const Span columns{std::max(face.first_column - tile.first_column, 0),
                     std::min(face.last_column - tile.first_column + 1, kTileSize_px)};
  const int first_row = std::max(face.first_row - tile.first_row, 0);
  const int end_row = std::min(face.last_row - tile.first_row + 1, kTileSize_px);
  const bool has_holes = face.material->opacity != nullptr;

  std::array<float, Samples> depth_step;
  for (std::size_t s = 0; s < Samples; ++s) {
    depth_step[s] = local.inverse_depth.dx * kPattern[s].x + local.inverse_depth.dy * kPattern[s].y;
  }

  for (int row = first_row; row < end_row; ++row) {
    Span touched = columns;
    Span inner = columns;
    for (std::size_t e = 0; e < static_cast<std::size_t>(local.edge_count); ++e) {
      const LocalPlane& edge = local.edges[e];
      const float value = edge(0.0F, static_cast<float>(row));
      clip_span(touched, edge.dx, value + edge.reach);
      clip_span(inner, edge.dx, value - edge.reach);
    }
    for (int column = touched.begin; column < touched.end; ++column) {
      const auto pixel = static_cast<std::size_t>(row * kTileSize_px + column);
      auto& depths = tile.inverse_depth[pixel];
      auto& ids = tile.face[pixel];
      const float centre = local.inverse_depth(static_cast<float>(column), static_cast<float>(row));
      if (column >= inner.begin && column < inner.end && !has_holes) {
        for (std::size_t s = 0; s < Samples; ++s) {
          const float depth = centre + depth_step[s];
          const bool nearer = depth > depths[s];
          depths[s] = nearer ? depth : depths[s];
          ids[s] = nearer ? id : ids[s];
        }
        continue;
      }
      std::array<bool, Samples> covered;
      for (std::size_t s = 0; s < Samples; ++s) {
        const float x = static_cast<float>(column) + kPattern[s].x;
        const float y = static_cast<float>(row) + kPattern[s].y;
        bool inside = centre + depth_step[s] > depths[s];
        for (std::size_t e = 0; e < static_cast<std::size_t>(local.edge_count); ++e) {
          inside &= local.edges[e](x, y) >= 0.0F;
        }
        covered[s] = inside;
      }
      if (has_holes) mask_holes<Samples>(face, tile.first_column + column, tile.first_row + row, covered);
      for (std::size_t s = 0; s < Samples; ++s) {
        if (!covered[s]) continue;
        depths[s] = centre + depth_step[s];
        ids[s] = id;
      }
    }
  }
}

template <int Samples>
[[nodiscard]] float farthest(const Tile<Samples>& tile) {
  std::array<float, Samples> lowest;
  lowest.fill(std::numeric_limits<float>::max());
  for (const auto& pixel : tile.inverse_depth) {
    for (std::size_t s = 0; s < Samples; ++s) lowest[s] = pixel[s] < lowest[s] ? pixel[s] : lowest[s];
  }
  return *std::min_element(lowest.begin(), lowest.end());
}

}  // namespace

template <int Samples>
void rasterize(Tile<Samples>& tile, std::span<const ScreenFace> faces,
               std::span<const std::uint32_t> listed) {
  for (auto& pixel : tile.inverse_depth) pixel.fill(0.0F);
  for (auto& pixel : tile.face) pixel.fill(kNoFace);
  float farthest_drawn = 0.0F;
  int drawn = 0;
  for (const std::uint32_t id : listed) {
    const ScreenFace& face = faces[id];
    const LocalFace local = localize(face, tile.first_column, tile.first_row);
    if (largest(local.inverse_depth) <= farthest_drawn) continue;
    rasterize_face(tile, face, local, id);
    if (++drawn % kFacesBetweenDepthChecks == 0) farthest_drawn = farthest(tile);
  }
}

template void rasterize<4>(Tile<4>&, std::span<const ScreenFace>, std::span<const std::uint32_t>);
template void rasterize<8>(Tile<8>&, std::span<const ScreenFace>, std::span<const std::uint32_t>);
template void rasterize<16>(Tile<16>&, std::span<const ScreenFace>, std::span<const std::uint32_t>);

}  // namespace stereo_slam::simulate
