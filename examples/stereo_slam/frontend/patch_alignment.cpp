// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/patch_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <Eigen/LU>

#include "stereo_slam/frontend/bilinear.hpp"

namespace stereo_slam {
namespace {

constexpr int kMaxIterations = 12;
constexpr double kConverged_px = 0.005;

/// The first pixel of an axis-aligned window around a centre, and the weights of bilinear interpolation,
/// which all its pixels share.
struct Window {
  const std::uint8_t* first;
  float upper_left, upper_right, lower_left, lower_right;

  Window(const cv::Mat& image, const Eigen::Vector2d& centre, int radius_px) {
    const double left = centre.x() - radius_px;
    const double top = centre.y() - radius_px;
    const int x0 = static_cast<int>(left);
    const int y0 = static_cast<int>(top);
    const auto ax = static_cast<float>(left - x0);
    const auto ay = static_cast<float>(top - y0);
    first = image.ptr<std::uint8_t>(y0) + x0;
    upper_left = (1.0F - ax) * (1.0F - ay);
    upper_right = ax * (1.0F - ay);
    lower_left = (1.0F - ax) * ay;
    lower_right = ax * ay;
  }

  template <class T>
  [[nodiscard]] T between(const T& ul, const T& ur, const T& ll, const T& lr) const {
    return upper_left * ul + upper_right * ur + lower_left * ll + lower_right * lr;
  }
};

[[nodiscard]] PatchPixels sample_window(const cv::Mat& image, const Eigen::Vector2d& centre) {
  const Window window(image, centre, PatchTemplate::kRadius_px);
  const std::uint8_t* pixels = window.first;
  EightFloats upper(pixels);
  EightFloats upper_right(pixels + 1);
  PatchPixels patch;
  for (std::size_t row = 0; row < PatchPixels::kSide; ++row) {
    pixels += image.step;
    const EightFloats lower(pixels);
    const EightFloats lower_right(pixels + 1);
    patch.set_row(row, window.between(upper.first, upper_right.first, lower.first, lower_right.first),
                  window.between(upper.last, upper_right.last, lower.last, lower_right.last));
    upper = lower;
    upper_right = lower_right;
  }
  return patch;
}

constexpr std::size_t kBorderedSide = PatchPixels::kSide + 2;

/// A patch with a border of one pixel. Each row is padded, so that two groups of four numbers can be read
/// from any of its first three pixels.
using BorderedPatch = std::array<std::array<float, 12>, kBorderedSide>;

[[nodiscard]] BorderedPatch sample_bordered(const cv::Mat& image, const Eigen::Vector2d& centre) {
  const Window window(image, centre, PatchTemplate::kRadius_px + 1);
  const std::uint8_t* upper = window.first;
  BorderedPatch bordered{};
  for (auto& row : bordered) {
    const std::uint8_t* lower = upper + image.step;
    const EightFloats ul(upper), ur(upper + 1), ll(lower), lr(lower + 1);
    const FourFloats first = window.between(ul.first, ur.first, ll.first, lr.first);
    const FourFloats last = window.between(ul.last, ur.last, ll.last, lr.last);
    std::memcpy(row.data(), &first, sizeof first);
    std::memcpy(row.data() + 4, &last, sizeof last);
    row[8] = window.between(static_cast<float>(upper[8]), static_cast<float>(upper[9]),
                            static_cast<float>(lower[8]), static_cast<float>(lower[9]));
    upper = lower;
  }
  return bordered;
}

/// Samples a warped patch with a border of one pixel.
[[nodiscard]] BorderedPatch sample_warped(const cv::Mat& image, const Eigen::Vector2d& centre_px,
                                          const PatchWarp& target_to_source) {
  constexpr int kReach = PatchTemplate::kRadius_px + 1;
  constexpr std::array<FourFloats, 2> kColumns{FourFloats{-4.0F, -3.0F, -2.0F, -1.0F},
                                               FourFloats{0.0F, 1.0F, 2.0F, 3.0F}};
  constexpr float kLastColumn = 4.0F;
  static_assert(kReach == 4 && kBorderedSide == 9);
  const Eigen::Matrix2f A = target_to_source.linear.cast<float>();
  const Eigen::Vector2f g = target_to_source.perspective.cast<float>();
  const Eigen::Vector2f c = centre_px.cast<float>();
  BorderedPatch bordered{};
  for (std::size_t row = 0; row < kBorderedSide; ++row) {
    const auto y = static_cast<float>(static_cast<int>(row) - kReach);
    const auto sample = [&](auto column) {
      const auto linear_x = A(0, 0) * column + A(0, 1) * y;
      const auto linear_y = A(1, 0) * column + A(1, 1) * y;
      const auto scale = 1.0F / (1.0F - g.x() * linear_x - g.y() * linear_y);
      return bilinear(image, c.x() + linear_x * scale, c.y() + linear_y * scale);
    };
    for (std::size_t half = 0; half < kColumns.size(); ++half) {
      const FourFloats four = sample(kColumns[half]);
      std::memcpy(bordered[row].data() + 4 * half, &four, sizeof four);
    }
    bordered[row][8] = sample(kLastColumn);
  }
  return bordered;
}

/// Grey values of a patch and their gradient along x and y.
struct DifferentiatedPatch {
  PatchPixels value;
  std::array<PatchPixels, 2> gradient;

  explicit DifferentiatedPatch(const BorderedPatch& bordered) {
    const auto eight_from = [](const float* values) {
      return std::array<FourFloats, 2>{load_four(values), load_four(values + 4)};
    };
    for (std::size_t row = 0; row < PatchPixels::kSide; ++row) {
      const auto& here = bordered[row + 1];
      const auto centre = eight_from(here.data() + 1);
      const auto left = eight_from(here.data());
      const auto right = eight_from(here.data() + 2);
      const auto above = eight_from(bordered[row].data() + 1);
      const auto below = eight_from(bordered[row + 2].data() + 1);
      value.set_row(row, centre[0], centre[1]);
      gradient[0].set_row(row, 0.5F * (right[0] - left[0]), 0.5F * (right[1] - left[1]));
      gradient[1].set_row(row, 0.5F * (below[0] - above[0]), 0.5F * (below[1] - above[1]));
    }
  }
};

/// Inverse of H = sum g g^T over the gradients g; nothing if a direction has less than `min_texture`.
[[nodiscard]] std::optional<Eigen::Matrix2f> inverse_structure_tensor(
    const std::array<PatchPixels, 2>& gradient, double min_texture) {
  const auto& [dx, dy] = gradient;
  Eigen::Matrix2d H;
  H(0, 0) = static_cast<double>(product(dx, dx));
  H(1, 1) = static_cast<double>(product(dy, dy));
  H(0, 1) = H(1, 0) = static_cast<double>(product(dx, dy));
  const double trace = H.trace();
  const double smallest = 0.5 * (trace - std::sqrt(trace * trace - 4.0 * H.determinant()));
  if (!(smallest > min_texture)) return std::nullopt;
  return H.inverse().cast<float>();
}

}  // namespace

Eigen::Matrix3d stereo_patch_covariance(const Eigen::Matrix2d& left_px2, const Eigen::Matrix2d& right_px2) {
  constexpr double kAlike = 1.5;  // variance of the displacement common to both, relative to the rest
  Eigen::Matrix3d covariance;
  covariance << (1.0 + kAlike) * left_px2, left_px2.col(0), left_px2.row(0), left_px2(0, 0) + right_px2(0, 0);
  return covariance;
}

double min_texture(const cv::Mat& image) {
  constexpr double kUsualContrast = 50.0;  // standard deviation, in grey levels; outdoor scenes have 50 to 80
  constexpr double kLeast = 100.0;         // four times the texture of camera noise
  constexpr int kStep_px = 8;
  double sum = 0.0, sum_of_squares = 0.0, count = 0.0;
  for (int y = kStep_px / 2; y < image.rows; y += kStep_px) {
    const auto* row = image.ptr<std::uint8_t>(y);
    for (int x = kStep_px / 2; x < image.cols; x += kStep_px) {
      const double value = row[x];
      sum += value;
      sum_of_squares += value * value;
      count += 1.0;
    }
  }
  if (!(count > 0.0)) return PatchTemplate::kTexture;
  const double variance = sum_of_squares / count - (sum / count) * (sum / count);
  return std::clamp(PatchTemplate::kTexture * variance / (kUsualContrast * kUsualContrast), kLeast,
                    PatchTemplate::kTexture);
}

std::optional<PatchTemplate> PatchTemplate::extract(const cv::Mat& image, const Eigen::Vector2d& centre_px,
                                                    const PatchWarp& target_to_source, double min_texture) {
  const Eigen::Vector2d extent = (kRadius_px + 1) * target_to_source.linear.cwiseAbs().rowwise().sum();
  const double shrinking = 1.0 - target_to_source.perspective.cwiseAbs().dot(extent);
  constexpr double kMinShrinking = 0.3;
  if (!(shrinking > kMinShrinking)) return std::nullopt;
  const double reach = extent.maxCoeff() / shrinking;
  if (!inside(image, centre_px.x(), centre_px.y(), reach)) return std::nullopt;

  // Without their means, values and gradients do not depend on the grey offset. Gradients orthogonal to the
  // values do not depend on the gain.
  const bool warped = !target_to_source.is_identity();
  DifferentiatedPatch pixels(warped ? sample_warped(image, centre_px, target_to_source)
                                    : sample_bordered(image, centre_px));
  pixels.value.subtract_mean();
  const float energy = product(pixels.value, pixels.value);
  if (!(energy > 0.0F)) return std::nullopt;
  for (auto& gradient : pixels.gradient) {
    gradient.subtract_mean();
    gradient.subtract(product(gradient, pixels.value) / energy, pixels.value);
  }
  const auto H_inverse = inverse_structure_tensor(pixels.gradient, min_texture);
  if (!H_inverse) return std::nullopt;

  PatchTemplate patch;
  patch.value_ = pixels.value;
  patch.H_inverse_ = *H_inverse;
  patch.norm_ = std::sqrt(static_cast<double>(energy));
  const auto& [dx, dy] = pixels.gradient;
  for (int i = 0; i < 2; ++i) {
    patch.step_[static_cast<std::size_t>(i)] = combination((*H_inverse)(i, 0), dx, (*H_inverse)(i, 1), dy);
  }
  return patch;
}

std::optional<PatchTemplate::Alignment> PatchTemplate::align(const cv::Mat& image,
                                                             const Eigen::Vector2d& start_px,
                                                             double max_shift_px) const {
  constexpr double kPixels = kSide_px * kSide_px;
  constexpr double kParameters = 4.0;            // shift, gain and offset
  constexpr double kRoundingVariance = 1.0 / 6;  // of the difference of two grey values
  Alignment result{.position_px = start_px};
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (!inside(image, result.position_px.x(), result.position_px.y(), kRadius_px + 1)) return std::nullopt;
    const PatchPixels window = sample_window(image, result.position_px);
    // value_ and step_ have zero mean, and step_ is orthogonal to value_: offset and gain drop out of the
    // products.
    const auto dot = static_cast<double>(product(window, value_));
    const auto sum = static_cast<double>(sum_of(window));
    const double energy = static_cast<double>(product(window, window)) - sum * sum / kPixels;
    if (!(energy > 1.0)) return std::nullopt;
    result.correlation = dot / (norm_ * std::sqrt(energy));
    if (!(result.correlation > 0.0)) return std::nullopt;
    const double gain = dot / (norm_ * norm_);
    const double noise_variance =
        std::max((energy - gain * dot) / (kPixels - kParameters), kRoundingVariance) / (gain * gain);
    result.covariance_px2 = noise_variance * H_inverse_.cast<double>();
    const Eigen::Vector2d shift(static_cast<double>(product(window, step_[0])) / -gain,
                                static_cast<double>(product(window, step_[1])) / -gain);
    result.position_px += shift;
    if (!((result.position_px - start_px).norm() <= max_shift_px)) return std::nullopt;
    if (shift.norm() < kConverged_px) return result;
  }
  return result;
}

}  // namespace stereo_slam
