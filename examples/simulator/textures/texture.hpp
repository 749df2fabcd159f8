// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace stereo_slam::simulator {

/// The part of a texture that a pixel covers, in texture periods: the texture coordinates of the pixel
/// centre, and their change from one pixel to the next along the image axes.
struct Footprint {
  double u = 0.0;
  double v = 0.0;
  double du_dx = 0.0;
  double dv_dx = 0.0;
  double du_dy = 0.0;
  double dv_dy = 0.0;
};

/// Grey texture that repeats with period 1 in u (columns) and v (rows), with a box-filtered mip-map pyramid.
///
/// Texel (i, j) of an n x m texture is centred at u = (j + 0.5) / m, v = (i + 0.5) / n. Values are 8 bit in
/// memory and [0, 1] when read.
class Texture {
 public:
  /// From an image whose sides are powers of two; throws std::invalid_argument otherwise.
  explicit Texture(const cv::Mat1b& base);

  /// Mean over the footprint: trilinear samples along the major axis of the footprint's ellipse (at most
  /// kMaxTaps), each as wide as its minor axis.
  [[nodiscard]] float sample(const Footprint& footprint) const;

  /// Mean over a circle around the footprint: one trilinear sample. Cheaper, and enough for smooth textures.
  [[nodiscard]] float sample_round(const Footprint& footprint) const;

  [[nodiscard]] int width() const noexcept { return levels_.front().width; }
  [[nodiscard]] int height() const noexcept { return levels_.front().height; }

  static constexpr int kMaxTaps = 12;

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> texels;
  };

  /// Position in a level: texels in 16.16 fixed point from the centre of the first one. Unsigned, so that it
  /// wraps with the texture.
  struct Position {
    std::uint32_t x = 0;
    std::uint32_t y = 0;
  };

  /// Two neighbouring levels and the share of the coarser one.
  struct Blend {
    const Level* fine;
    const Level* coarse;
    float weight;
  };

  /// Levels for a sample as wide as this many texels of the finest.
  [[nodiscard]] Blend blend(double width_texels) const;
  [[nodiscard]] static Position position(const Level& level, double u, double v) noexcept;
  /// The same place in the next coarser level.
  [[nodiscard]] static Position halved(Position position) noexcept;
  /// Bilinear value in units of 2^-16 grey levels.
  [[nodiscard]] static std::uint32_t bilinear(const Level& level, Position position) noexcept;

  std::vector<Level> levels_;
};

}  // namespace stereo_slam::simulator
