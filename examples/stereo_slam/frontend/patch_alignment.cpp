// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/patch_alignment.hpp"

#include <cmath>

#include <Eigen/LU>

namespace stereo_slam {
namespace {

constexpr int kMaxIterations = 12;
constexpr double kConverged_px = 0.005;
constexpr double kMinGradientEnergy = 800.0;  // smallest eigenvalue of the structure tensor, grey levels^2

[[nodiscard]] bool inside(const cv::Mat& image, double x, double y, double margin_px) {
  return x >= margin_px && y >= margin_px && x < image.cols - 1 - margin_px && y < image.rows - 1 - margin_px;
}

[[nodiscard]] float bilinear(const cv::Mat& image, float x, float y) {
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const float ax = x - static_cast<float>(x0);
  const float ay = y - static_cast<float>(y0);
  const std::uint8_t* upper = image.ptr<std::uint8_t>(y0) + x0;
  const std::uint8_t* lower = upper + image.step;
  const float top = static_cast<float>(upper[0]) + ax * static_cast<float>(upper[1] - upper[0]);
  const float bottom = static_cast<float>(lower[0]) + ax * static_cast<float>(lower[1] - lower[0]);
  return top + ay * (bottom - top);
}

/// Samples the axis-aligned window around a centre: all pixels share one bilinear weight.
void sample_window(const cv::Mat& image, const Eigen::Vector2d& centre,
                   std::array<float, PatchTemplate::kPixels>& out) {
  const double left = centre.x() - PatchTemplate::kRadius_px;
  const double top = centre.y() - PatchTemplate::kRadius_px;
  const int x0 = static_cast<int>(left);
  const int y0 = static_cast<int>(top);
  const auto ax = static_cast<float>(left - x0);
  const auto ay = static_cast<float>(top - y0);
  const float w00 = (1.0F - ax) * (1.0F - ay);
  const float w01 = ax * (1.0F - ay);
  const float w10 = (1.0F - ax) * ay;
  const float w11 = ax * ay;
  for (int row = 0; row < PatchTemplate::kSide_px; ++row) {
    const std::uint8_t* upper = image.ptr<std::uint8_t>(y0 + row) + x0;
    const std::uint8_t* lower = upper + image.step;
    float* target = out.data() + row * PatchTemplate::kSide_px;
    for (int column = 0; column < PatchTemplate::kSide_px; ++column) {
      target[column] = w00 * static_cast<float>(upper[column]) + w01 * static_cast<float>(upper[column + 1]) +
                       w10 * static_cast<float>(lower[column]) + w11 * static_cast<float>(lower[column + 1]);
    }
  }
}

constexpr std::size_t kPixels = PatchTemplate::kPixels;
constexpr int kBorderedSide_px = PatchTemplate::kSide_px + 2;
using BorderedPatch = std::array<float, kBorderedSide_px * kBorderedSide_px>;

/// Samples a warped patch with a border of one pixel.
[[nodiscard]] BorderedPatch sample_warped(const cv::Mat& image, const Eigen::Vector2d& centre_px,
                                          const Eigen::Matrix2d& target_to_source) {
  constexpr int kRadius_px = PatchTemplate::kRadius_px;
  BorderedPatch bordered;
  const Eigen::Matrix2f A = target_to_source.cast<float>();
  const Eigen::Vector2f c = centre_px.cast<float>();
  for (int row = 0; row < kBorderedSide_px; ++row) {
    for (int column = 0; column < kBorderedSide_px; ++column) {
      const Eigen::Vector2f offset(static_cast<float>(column - kRadius_px - 1),
                                   static_cast<float>(row - kRadius_px - 1));
      const Eigen::Vector2f source = c + A * offset;
      bordered[static_cast<std::size_t>(row * kBorderedSide_px + column)] =
          bilinear(image, source.x(), source.y());
    }
  }
  return bordered;
}

/// Grey values of a patch and their gradient along x and y.
struct PatchPixels {
  std::array<float, kPixels> value;
  std::array<std::array<float, kPixels>, 2> gradient;
};

[[nodiscard]] PatchPixels differentiate(const BorderedPatch& bordered) {
  constexpr std::size_t kSide = PatchTemplate::kSide_px;
  PatchPixels pixels;
  for (std::size_t row = 0; row < kSide; ++row) {
    for (std::size_t column = 0; column < kSide; ++column) {
      const std::size_t i = row * kSide + column;
      const float* centre = bordered.data() + (row + 1) * kBorderedSide_px + column + 1;
      pixels.value[i] = *centre;
      pixels.gradient[0][i] = 0.5F * (centre[1] - centre[-1]);
      pixels.gradient[1][i] = 0.5F * (centre[kBorderedSide_px] - centre[-kBorderedSide_px]);
    }
  }
  return pixels;
}

void subtract_mean(std::array<float, kPixels>& values) {
  double sum = 0.0;
  for (const float value : values) sum += static_cast<double>(value);
  const auto mean = static_cast<float>(sum / static_cast<double>(kPixels));
  for (float& value : values) value -= mean;
}

/// Sum of the products.
[[nodiscard]] double product(const std::array<float, kPixels>& a, const std::array<float, kPixels>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < kPixels; ++i) sum += static_cast<double>(a[i] * b[i]);
  return sum;
}

/// Inverse of H = sum g g^T over the gradients g; nothing if a direction has too little texture.
[[nodiscard]] std::optional<Eigen::Matrix2f> inverse_structure_tensor(const PatchPixels& pixels) {
  Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < kPixels; ++i) {
    const Eigen::Vector2d g(static_cast<double>(pixels.gradient[0][i]),
                            static_cast<double>(pixels.gradient[1][i]));
    H += g * g.transpose();
  }
  const double trace = H.trace();
  const double smallest = 0.5 * (trace - std::sqrt(trace * trace - 4.0 * H.determinant()));
  if (!(smallest > kMinGradientEnergy)) return std::nullopt;
  return H.inverse().cast<float>();
}

}  // namespace

std::optional<PatchTemplate> PatchTemplate::extract(const cv::Mat& image, const Eigen::Vector2d& centre_px,
                                                    const Eigen::Matrix2d& target_to_source) {
  const double reach = (kRadius_px + 1) * target_to_source.cwiseAbs().rowwise().sum().maxCoeff();
  if (!inside(image, centre_px.x(), centre_px.y(), reach)) return std::nullopt;

  // Values and gradients without their means are independent of the offset; gradients orthogonal to the
  // values, of the gain.
  PatchPixels pixels = differentiate(sample_warped(image, centre_px, target_to_source));
  subtract_mean(pixels.value);
  for (auto& gradient : pixels.gradient) subtract_mean(gradient);
  const double energy = product(pixels.value, pixels.value);
  if (!(energy > 0.0)) return std::nullopt;
  for (auto& gradient : pixels.gradient) {
    const auto gain = static_cast<float>(product(gradient, pixels.value) / energy);
    for (std::size_t i = 0; i < gradient.size(); ++i) gradient[i] -= gain * pixels.value[i];
  }
  const auto H_inverse = inverse_structure_tensor(pixels);
  if (!H_inverse) return std::nullopt;

  PatchTemplate patch;
  patch.value_ = pixels.value;
  patch.norm_ = std::sqrt(energy);
  const auto& [dx, dy] = pixels.gradient;
  for (std::size_t i = 0; i < dx.size(); ++i) {
    patch.step_[0][i] = (*H_inverse)(0, 0) * dx[i] + (*H_inverse)(0, 1) * dy[i];
    patch.step_[1][i] = (*H_inverse)(1, 0) * dx[i] + (*H_inverse)(1, 1) * dy[i];
  }
  return patch;
}

std::optional<PatchTemplate::Alignment> PatchTemplate::align(const cv::Mat& image,
                                                             const Eigen::Vector2d& start_px,
                                                             double max_shift_px) const {
  std::array<float, kPixels> window;
  Alignment result{start_px, 0.0};
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (!inside(image, result.position_px.x(), result.position_px.y(), kRadius_px + 1)) return std::nullopt;
    sample_window(image, result.position_px, window);
    // value_ and step_ have zero mean, and step_ is orthogonal to value_: offset and gain drop out of the
    // products.
    float dot = 0.0F;
    float sum = 0.0F;
    float energy = 0.0F;
    float dx = 0.0F;
    float dy = 0.0F;
    for (std::size_t i = 0; i < kPixels; ++i) {
      dot += window[i] * value_[i];
      sum += window[i];
      energy += window[i] * window[i];
      dx += window[i] * step_[0][i];
      dy += window[i] * step_[1][i];
    }
    const double variance =
        static_cast<double>(energy) - static_cast<double>(sum) * static_cast<double>(sum) / kPixels;
    if (!(variance > 1.0)) return std::nullopt;
    result.correlation = static_cast<double>(dot) / (norm_ * std::sqrt(variance));
    if (!(result.correlation > 0.0)) return std::nullopt;
    const double gain = static_cast<double>(dot) / (norm_ * norm_);
    const Eigen::Vector2d shift = -Eigen::Vector2d(static_cast<double>(dx), static_cast<double>(dy)) / gain;
    result.position_px += shift;
    if (!((result.position_px - start_px).norm() <= max_shift_px)) return std::nullopt;
    if (shift.norm() < kConverged_px) return result;
  }
  return result;
}

}  // namespace stereo_slam
