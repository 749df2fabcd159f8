// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace stereo_slam::simulate {

/// What a pixel covers of a texture, in texture periods: its centre, and how the texture coordinates change
/// from one pixel to the next along the image axes.
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

  /// Bilinear value at one level of the pyramid, clamped to those there are.
  [[nodiscard]] float sample_level(double u, double v, int level) const;

  /// Level whose texels are as wide as the footprint (geometric mean of its axes).
  [[nodiscard]] int nearest_level(const Footprint& footprint) const;

  [[nodiscard]] int width() const noexcept { return levels_.front().width; }
  [[nodiscard]] int height() const noexcept { return levels_.front().height; }

  static constexpr int kMaxTaps = 12;

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> texels;
  };

  /// Bilinear value, 0 .. 255, at (u, v) in [0, 1).
  [[nodiscard]] static float bilinear(const Level& level, float u, float v) noexcept;

  std::vector<Level> levels_;
};

}  // namespace stereo_slam::simulate
