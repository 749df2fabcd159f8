// SPDX-License-Identifier: MIT
#include "texture.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>

namespace stereo_slam::simulate {
namespace {

[[nodiscard]] float fraction(double x) noexcept { return static_cast<float>(x - std::floor(x)); }

/// Axes of the ellipse that J, the Jacobian from pixels to texels, makes of the unit circle.
struct Ellipse {
  double major = 0.0;  ///< length, texels
  double minor = 0.0;
  double major_u = 1.0;  ///< unit direction of the major axis, texels
  double major_v = 0.0;
};

[[nodiscard]] Ellipse footprint_ellipse(const Footprint& f, int width, int height) {
  const double ux = f.du_dx * width;
  const double uy = f.du_dy * width;
  const double vx = f.dv_dx * height;
  const double vy = f.dv_dy * height;
  const double uu = ux * ux + uy * uy;  // J J^T
  const double uv = ux * vx + uy * vy;
  const double vv = vx * vx + vy * vy;
  const double mean = 0.5 * (uu + vv);
  const double half_difference = 0.5 * (uu - vv);
  const double spread = std::sqrt(half_difference * half_difference + uv * uv);
  Ellipse ellipse;
  ellipse.major = std::sqrt(mean + spread);
  ellipse.minor = std::sqrt(std::max(mean - spread, 0.0));
  if (spread > 0.0) {  // eigenvector of the larger eigenvalue, from the better conditioned row
    const double a = half_difference >= 0.0 ? half_difference + spread : uv;
    const double b = half_difference >= 0.0 ? uv : spread - half_difference;
    const double norm = std::sqrt(a * a + b * b);
    if (norm > 0.0) {
      ellipse.major_u = a / norm;
      ellipse.major_v = b / norm;
    }
  }
  return ellipse;
}

}  // namespace

Texture::Texture(const cv::Mat1b& base) {
  const auto is_power_of_two = [](int n) { return n > 0 && std::has_single_bit(static_cast<unsigned>(n)); };
  if (!is_power_of_two(base.cols) || !is_power_of_two(base.rows)) {
    throw std::invalid_argument("texture sides must be powers of two, not " + std::to_string(base.cols) +
                                " x " + std::to_string(base.rows));
  }
  cv::Mat1f image;
  base.convertTo(image, CV_32F);
  for (;;) {
    Level level{image.cols, image.rows, {}};
    level.texels.reserve(static_cast<std::size_t>(image.cols) * static_cast<std::size_t>(image.rows));
    for (const float value : image) level.texels.push_back(cv::saturate_cast<std::uint8_t>(value));
    levels_.push_back(std::move(level));
    if (image.cols == 1 && image.rows == 1) break;
    cv::Mat1f half(std::max(1, image.rows / 2), std::max(1, image.cols / 2));
    const int step_x = image.cols / half.cols;
    const int step_y = image.rows / half.rows;
    for (int y = 0; y < half.rows; ++y) {
      for (int x = 0; x < half.cols; ++x) {
        const int x0 = x * step_x;
        const int y0 = y * step_y;
        const int x1 = x0 + step_x - 1;
        const int y1 = y0 + step_y - 1;
        half(y, x) = 0.25F * (image(y0, x0) + image(y0, x1) + image(y1, x0) + image(y1, x1));
      }
    }
    image = half;
  }
}

float Texture::bilinear(const Level& level, float u, float v) noexcept {
  // Adding the size keeps the coordinate positive, so that truncation is floor.
  const float x = u * static_cast<float>(level.width) + (static_cast<float>(level.width) - 0.5F);
  const float y = v * static_cast<float>(level.height) + (static_cast<float>(level.height) - 0.5F);
  const int xi = static_cast<int>(x);
  const int yi = static_cast<int>(y);
  const float fx = x - static_cast<float>(xi);
  const float fy = y - static_cast<float>(yi);
  const int x0 = xi & (level.width - 1);
  const int x1 = (xi + 1) & (level.width - 1);
  const std::uint8_t* row0 = level.texels.data() + (yi & (level.height - 1)) * level.width;
  const std::uint8_t* row1 = level.texels.data() + ((yi + 1) & (level.height - 1)) * level.width;
  const auto top = static_cast<float>(row0[x0]) + fx * static_cast<float>(row0[x1] - row0[x0]);
  const auto bottom = static_cast<float>(row1[x0]) + fx * static_cast<float>(row1[x1] - row1[x0]);
  return top + fy * (bottom - top);
}

float Texture::sample_level(double u, double v, int level) const {
  const int last = static_cast<int>(levels_.size()) - 1;
  return bilinear(levels_[static_cast<std::size_t>(std::clamp(level, 0, last))], fraction(u), fraction(v)) /
         255.0F;
}

int Texture::nearest_level(const Footprint& footprint) const {
  const double determinant = footprint.du_dx * footprint.dv_dy - footprint.du_dy * footprint.dv_dx;
  const double texels = std::abs(determinant) * width() * height();
  return texels > 1.0 ? static_cast<int>(0.5 * std::log2(texels) + 0.5) : 0;
}

float Texture::sample(const Footprint& footprint) const {
  const Ellipse ellipse = footprint_ellipse(footprint, width(), height());
  const double thinnest = std::max(ellipse.minor, 1e-3);
  const int taps =
      ellipse.major <= 1.0
          ? 1
          : std::clamp(static_cast<int>(std::ceil(ellipse.major / std::max(thinnest, 1.0))), 1, kMaxTaps);
  const double tap_width = std::max(thinnest, ellipse.major / taps);
  const double lod = std::clamp(std::log2(tap_width), 0.0, static_cast<double>(levels_.size() - 1));
  const auto fine = static_cast<std::size_t>(lod);
  const auto blend = static_cast<float>(lod - static_cast<double>(fine));
  const Level& fine_level = levels_[fine];
  const Level& coarse_level = levels_[std::min(fine + 1, levels_.size() - 1)];

  const double step_u = ellipse.major_u * ellipse.major / (taps * width());
  const double step_v = ellipse.major_v * ellipse.major / (taps * height());
  float sum = 0.0F;
  for (int tap = 0; tap < taps; ++tap) {
    const double offset = tap - 0.5 * (taps - 1);
    const float u = fraction(footprint.u + offset * step_u);
    const float v = fraction(footprint.v + offset * step_v);
    float value = bilinear(fine_level, u, v);
    if (blend > 0.0F) value += blend * (bilinear(coarse_level, u, v) - value);
    sum += value;
  }
  return sum / (255.0F * static_cast<float>(taps));
}

}  // namespace stereo_slam::simulate
