// SPDX-License-Identifier: MIT
#include "simulator/textures/texture.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>

namespace stereo_slam::simulator {
namespace {

constexpr double kOne = 65536.0;  ///< 1 in the fixed-point positions
constexpr std::uint32_t kHalf = 1U << 15;
constexpr float kWhite = 255.0F * 65536.0F;  ///< white in the fixed-point values

/// log2(x) for x >= 1, continuous and exact at powers of two, at most 0.09 too small between them.
[[nodiscard]] float rough_log2(float x) noexcept {
  return static_cast<float>(std::bit_cast<std::uint32_t>(x)) * 0x1.0p-23F - 127.0F;
}

/// Axes of the ellipse to which J, the Jacobian from pixels to texels, maps the unit circle.
class Ellipse {
 public:
  Ellipse(const Footprint& f, int width, int height) {
    const double ux = f.du_dx * width;
    const double uy = f.du_dy * width;
    const double vx = f.dv_dx * height;
    const double vy = f.dv_dy * height;
    uv_ = ux * vx + uy * vy;  // J J^T
    const double uu = ux * ux + uy * uy;
    const double vv = vx * vx + vy * vy;
    const double mean = 0.5 * (uu + vv);
    half_difference_ = 0.5 * (uu - vv);
    spread_ = std::sqrt(half_difference_ * half_difference_ + uv_ * uv_);
    major_ = std::sqrt(mean + spread_);
    minor_ = std::sqrt(std::max(mean - spread_, 0.0));
  }

  [[nodiscard]] double major() const noexcept { return major_; }  ///< length, texels
  [[nodiscard]] double minor() const noexcept { return minor_; }

  /// The major axis, texels; for an ellipse that is not a circle.
  [[nodiscard]] std::array<double, 2> major_axis() const {
    // Eigenvector of the larger eigenvalue, from the better conditioned row.
    const double a = half_difference_ >= 0.0 ? half_difference_ + spread_ : uv_;
    const double b = half_difference_ >= 0.0 ? uv_ : spread_ - half_difference_;
    const double scale = major_ / std::sqrt(a * a + b * b);
    return {scale * a, scale * b};
  }

 private:
  double uv_;
  double half_difference_;
  double spread_;
  double major_;
  double minor_;
};

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

inline Texture::Position Texture::position(const Level& level, double u, double v) noexcept {
  const auto fixed = [](double texels) {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(texels * kOne)) - kHalf;
  };
  return {fixed(u * level.width), fixed(v * level.height)};
}

inline Texture::Position Texture::halved(Position position) noexcept {
  return {((position.x + kHalf) >> 1) - kHalf, ((position.y + kHalf) >> 1) - kHalf};
}

inline std::uint32_t Texture::bilinear(const Level& level, Position position) noexcept {
  const auto column_mask = static_cast<std::uint32_t>(level.width - 1);
  const auto row_mask = static_cast<std::uint32_t>(level.height - 1);
  const std::uint32_t column = position.x >> 16;
  const std::uint32_t row = position.y >> 16;
  const std::uint32_t right = (position.x >> 8) & 255U;  // weights of 256
  const std::uint32_t below = (position.y >> 8) & 255U;
  const std::uint32_t x0 = column & column_mask;
  const std::uint32_t x1 = (column + 1) & column_mask;
  const std::uint8_t* row0 = level.texels.data() + (row & row_mask) * static_cast<std::uint32_t>(level.width);
  const std::uint8_t* row1 =
      level.texels.data() + ((row + 1) & row_mask) * static_cast<std::uint32_t>(level.width);
  const std::uint32_t top = row0[x0] * (256U - right) + row0[x1] * right;
  const std::uint32_t bottom = row1[x0] * (256U - right) + row1[x1] * right;
  return top * (256U - below) + bottom * below;
}

inline Texture::Blend Texture::blend(double width_texels) const {
  const float lod = rough_log2(std::max(1.0F, static_cast<float>(width_texels)));
  const auto level = std::min(static_cast<std::size_t>(lod), levels_.size() - 1);
  // Two levels are blended only in the middle between them; near a level, that level alone is used.
  const float weight = 2.0F * (lod - static_cast<float>(level)) - 0.5F;
  if (weight <= 0.0F || level + 1 == levels_.size()) return {&levels_[level], &levels_[level], 0.0F};
  if (weight >= 1.0F) return {&levels_[level + 1], &levels_[level + 1], 0.0F};
  return {&levels_[level], &levels_[level + 1], weight};
}

float Texture::sample_round(const Footprint& f) const {
  const double along_x = f.du_dx * f.du_dx + f.du_dy * f.du_dy;
  const double along_y = f.dv_dx * f.dv_dx + f.dv_dy * f.dv_dy;
  const Blend levels = blend(width() * std::sqrt(std::max(along_x, along_y)));
  const Position fine = position(*levels.fine, f.u, f.v);
  const auto value = static_cast<float>(bilinear(*levels.fine, fine));
  if (levels.weight == 0.0F) return value / kWhite;
  const auto coarse = static_cast<float>(bilinear(*levels.coarse, halved(fine)));
  return (value + levels.weight * (coarse - value)) / kWhite;
}

float Texture::sample(const Footprint& footprint) const {
  const Ellipse ellipse(footprint, width(), height());
  // A footprint up to a quarter longer than wide is treated as round: one tap.
  const double elongation =
      std::min(ellipse.major() / std::max(ellipse.minor(), 1.0), static_cast<double>(kMaxTaps));
  const int taps = std::max(1, static_cast<int>(elongation + 0.75));
  const Blend levels = blend(std::max(ellipse.minor(), ellipse.major() / taps));

  Position tap = position(*levels.fine, footprint.u, footprint.v);
  Position step;
  if (taps > 1) {
    const auto [major_u, major_v] = ellipse.major_axis();
    const auto fixed = [taps](double axis, int finest, int size) {
      return static_cast<std::int64_t>(axis / (finest * taps) * size * kOne);
    };
    const std::int64_t du = fixed(major_u, width(), levels.fine->width);
    const std::int64_t dv = fixed(major_v, height(), levels.fine->height);
    step = {static_cast<std::uint32_t>(du), static_cast<std::uint32_t>(dv)};
    tap.x -= static_cast<std::uint32_t>(du * (taps - 1) / 2);
    tap.y -= static_cast<std::uint32_t>(dv * (taps - 1) / 2);
  }
  std::uint32_t fine = 0;  // at most kMaxTaps * 255 * 2^16
  std::uint32_t coarse = 0;
  for (int i = 0; i < taps; ++i) {
    fine += bilinear(*levels.fine, tap);
    if (levels.weight > 0.0F) coarse += bilinear(*levels.coarse, halved(tap));
    tap = {tap.x + step.x, tap.y + step.y};
  }
  const auto sum =
      static_cast<float>(fine) + levels.weight * (static_cast<float>(coarse) - static_cast<float>(fine));
  return sum / (kWhite * static_cast<float>(taps));
}

}  // namespace stereo_slam::simulator
