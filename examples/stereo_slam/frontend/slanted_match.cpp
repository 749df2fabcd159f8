// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/slanted_match.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/frontend/bilinear.hpp"

namespace stereo_slam {
namespace {

// The smallest patch that shows slopes well. Larger ones contain other surfaces: with 11 x 11 pixels the
// estimated path is too long.
constexpr int kWindowRadius_px = 4;
constexpr int kWindowSide_px = 2 * kWindowRadius_px + 1;
constexpr float kGreySigma = 4.0F;  // grey levels: noise, and differences that a plane does not explain
constexpr int kMaxSteps = 8;
constexpr float kSettled_px = 0.01F;
constexpr float kRoughly_px = 0.05F;  // settled enough to choose a prior
constexpr float kMaxDrift_px = 2.0F;
constexpr float kMaxSlope = 1.0F;

using Pixels = Eigen::Array<float, kWindowSide_px * kWindowSide_px, 1>;
using Parameters = Eigen::Vector4f;  // shift in u and v, px; d disparity / d u and d disparity / d v

/// Gaussian prior of a slope, with the same deviation in both directions.
struct SlopePrior {
  Eigen::Vector2f mean = Eigen::Vector2f::Zero();
  float sigma = 0.2F;  // a road seen from KITTI's camera has a slope of 0.33

  /// Information on the parameters, times the variance of the grey values. The shift has no prior.
  [[nodiscard]] Eigen::Matrix4f information() const {
    const float ratio = kGreySigma / sigma;
    return Eigen::Vector4f(0.0F, 0.0F, ratio * ratio, ratio * ratio).asDiagonal();
  }
};

constexpr float kSurfaceSigma = 0.03F;  // of the slope of a road or a wall

/// The pixels of the right image that belong to those of the left window.
[[nodiscard]] Pixels sample_slanted(const cv::Mat& image, const Eigen::Vector2f& centre,
                                    const Eigen::Vector2f& slope) {
  constexpr std::array<FourFloats, 2> kColumns{FourFloats{-4.0F, -3.0F, -2.0F, -1.0F},
                                               FourFloats{0.0F, 1.0F, 2.0F, 3.0F}};
  constexpr float kLastColumn = 4.0F;
  static_assert(kWindowRadius_px == 4);
  Pixels pixels;
  float* value = pixels.data();
  for (int y = -kWindowRadius_px; y <= kWindowRadius_px; ++y) {
    const auto row = static_cast<float>(y);
    const FourFloats rows = FourFloats{} + (centre.y() + row);
    for (const FourFloats& column : kColumns) {
      const FourFloats nearer_px = slope.x() * column + slope.y() * row;
      const FourFloats four = bilinear(image, centre.x() + column - nearer_px, rows);
      std::memcpy(value, &four, sizeof four);
      value += 4;
    }
    const float nearer_px = slope.x() * kLastColumn + slope.y() * row;
    *value++ = bilinear(image, centre.x() + kLastColumn - nearer_px, centre.y() + row);
  }
  return pixels;
}

constexpr int kBorderedSide_px = kWindowSide_px + 2;
using BorderedPixels = Eigen::Array<float, kBorderedSide_px, kBorderedSide_px, Eigen::RowMajor>;

/// Axis-aligned window around a point, with a border of one pixel.
[[nodiscard]] BorderedPixels sample_bordered_window(const cv::Mat& image, const Eigen::Vector2f& centre) {
  using Grey = Eigen::Array<std::uint8_t, kBorderedSide_px, kBorderedSide_px, Eigen::RowMajor>;
  const Eigen::Vector2f corner = centre.array() - static_cast<float>(kWindowRadius_px + 1);
  const auto column = static_cast<int>(corner.x());
  const auto row = static_cast<int>(corner.y());
  const float right = corner.x() - static_cast<float>(column);
  const float down = corner.y() - static_cast<float>(row);
  const auto pixels = [&](int x, int y) {
    const Eigen::OuterStride<> stride(static_cast<Eigen::Index>(image.step));
    return Eigen::Map<const Grey, 0, Eigen::OuterStride<>>(image.ptr<std::uint8_t>(y) + x, stride)
        .cast<float>();
  };
  if (right == 0.0F && down == 0.0F) return pixels(column, row);  // FAST corners are at whole pixels
  return (1.0F - down) * ((1.0F - right) * pixels(column, row) + right * pixels(column + 1, row)) +
         down * ((1.0F - right) * pixels(column, row + 1) + right * pixels(column + 1, row + 1));
}

/// The left window, prepared for the inverse compositional alignment of the right one.
class SlantedTemplate {
 public:
  SlantedTemplate(const cv::Mat& left, const Eigen::Vector2f& centre) {
    const BorderedPixels bordered = sample_bordered_window(left, centre);
    const auto window = [&](Eigen::Index row, Eigen::Index column) {
      return bordered.block<kWindowSide_px, kWindowSide_px>(row, column).reshaped<Eigen::RowMajor>();
    };
    value_ = window(1, 1);
    const Pixels dx = 0.5F * (window(1, 2) - window(1, 0));
    const Pixels dy = 0.5F * (window(2, 1) - window(0, 1));
    gradient_ = {dx, dy, -dx * offsets()[0], -dx * offsets()[1]};
    value_ -= value_.mean();
    energy_ = value_.square().sum();
    // Without their mean, gradients do not depend on the grey offset; orthogonal to the values, not on the
    // gain.
    for (auto& gradient : gradient_) {
      gradient -= gradient.mean();
      if (energy_ > 0.0F) gradient -= (gradient * value_).sum() / energy_ * value_;
    }
    for (Eigen::Index i = 0; i < 4; ++i) {
      for (Eigen::Index j = 0; j < 4; ++j) information_(i, j) = product(at(i), at(j));
    }
  }

  /// Inverse of the Hessian of half the squared error of the grey values, including the prior.
  [[nodiscard]] Eigen::Matrix4f inverse_hessian(const SlopePrior& prior) const {
    const Eigen::Matrix4f hessian = information_ + prior.information();
    return hessian.ldlt().solve(Eigen::Matrix4f::Identity());
  }

  /// Correlation of the window with the sampled pixels of the right image; 0 if one of them is uniform.
  [[nodiscard]] double correlation(const Pixels& right) const {
    const float energy = energy_ * (right - right.mean()).square().sum();
    return energy > 0.0F ? static_cast<double>(product(right, value_) / std::sqrt(energy)) : 0.0;
  }

  /// Gradient, with respect to the parameters, of half the squared error of the grey values. `right` are the
  /// sampled pixels of the right image; nothing if they do not correlate with the window.
  [[nodiscard]] std::optional<Parameters> error_gradient(const Pixels& right) const {
    const float gain = energy_ > 0.0F ? product(right, value_) / energy_ : 0.0F;
    if (!(gain > 0.0F)) return std::nullopt;
    Parameters result;
    for (Eigen::Index i = 0; i < 4; ++i) result[i] = product(at(i), right) / gain;
    return result;
  }

  /// Covariance of the slope from the texture alone; nothing if the texture does not determine the slope.
  [[nodiscard]] std::optional<Eigen::Matrix2f> slope_covariance() const {
    const Eigen::LDLT<Eigen::Matrix4f> ldlt(information_);
    if (ldlt.info() != Eigen::Success || !ldlt.isPositive()) return std::nullopt;
    const Eigen::Matrix4f covariance = kGreySigma * kGreySigma * ldlt.solve(Eigen::Matrix4f::Identity());
    if (!covariance.allFinite()) return std::nullopt;
    return covariance.bottomRightCorner<2, 2>();
  }

 private:
  [[nodiscard]] static float product(const Pixels& a, const Pixels& b) { return (a * b).sum(); }
  [[nodiscard]] const Pixels& at(Eigen::Index i) const { return gradient_[static_cast<std::size_t>(i)]; }

  /// Columns and rows of the pixels, from the centre.
  [[nodiscard]] static const std::array<Pixels, 2>& offsets() {
    static const std::array<Pixels, 2> kOffsets = [] {
      std::array<Pixels, 2> result;
      for (Eigen::Index i = 0; i < result[0].size(); ++i) {
        result[0][i] = static_cast<float>(i % kWindowSide_px - kWindowRadius_px);
        const Eigen::Index row = i / kWindowSide_px;
        result[1][i] = static_cast<float>(row - kWindowRadius_px);
      }
      return result;
    }();
    return kOffsets;
  }

  Pixels value_;
  float energy_ = 0.0F;
  std::array<Pixels, 4> gradient_;  // of the values with respect to the parameters
  Eigen::Matrix4f information_;     // times the variance of the grey values
};

/// Prior of the likely surface that explains `slope` best; nothing if the general prior explains it better.
/// `slope` was estimated with the general prior; `covariance` is that of the texture alone.
[[nodiscard]] std::optional<SlopePrior> likely_surface(const Eigen::Vector2f& slope,
                                                       const Eigen::Matrix2f& covariance,
                                                       std::span<const Eigen::Vector2d> likely_slopes) {
  const SlopePrior any;
  std::optional<SlopePrior> best;
  // The slope from the texture alone: the estimate with the effect of the prior removed.
  const Eigen::Vector2f measured = slope + covariance * (slope - any.mean) / (any.sigma * any.sigma);
  const auto cost = [&](const SlopePrior& prior) {
    const Eigen::Matrix2f S = covariance + prior.sigma * prior.sigma * Eigen::Matrix2f::Identity();
    const Eigen::Vector2f error = measured - prior.mean;
    return error.dot(S.inverse() * error) + std::log(S.determinant());
  };
  float least = cost(any);
  for (const auto& likely : likely_slopes) {
    const SlopePrior surface{likely.cast<float>(), kSurfaceSigma};
    const float value = cost(surface);
    if (!(value < least)) continue;
    least = value;
    best = surface;
  }
  return best;
}

/// Where the right image is searched: at start_px plus the first two parameters.
struct RightPlace {
  const cv::Mat& image;
  Eigen::Vector2f start_px;
};

/// Iterates from `parameters` until a step moves no pixel by more than `settled_px`, or for kMaxSteps.
/// Returns the correlation of the windows before the last step; nothing if the window leaves the image, does
/// not correlate, or moves or slopes too far.
[[nodiscard]] std::optional<double> settle(const SlantedTemplate& patch, const RightPlace& right,
                                           const SlopePrior& prior, float settled_px,
                                           Parameters& parameters) {
  const Eigen::Matrix4f inverse_hessian = patch.inverse_hessian(prior);
  Pixels pixels;
  for (int iteration = 0; iteration < kMaxSteps; ++iteration) {
    const Eigen::Vector2f centre = right.start_px + parameters.head<2>();
    const Eigen::Vector2f slope = parameters.tail<2>();
    const double reach_px = kWindowRadius_px * (1.0 + static_cast<double>(slope.cwiseAbs().sum()));
    if (!inside(right.image, static_cast<double>(centre.x()), static_cast<double>(centre.y()), reach_px)) {
      return std::nullopt;
    }
    pixels = sample_slanted(right.image, centre, slope);
    const auto error_gradient = patch.error_gradient(pixels);
    if (!error_gradient) return std::nullopt;
    Parameters from_prior = parameters;
    from_prior.tail<2>() -= prior.mean;
    const Parameters change = inverse_hessian * (*error_gradient + prior.information() * from_prior);
    parameters -= change;
    if (!(parameters.head<2>().norm() <= kMaxDrift_px) ||
        !(parameters.tail<2>().cwiseAbs().maxCoeff() <= kMaxSlope)) {
      return std::nullopt;
    }
    const float moved_px = change.head<2>().norm() + kWindowRadius_px * change.tail<2>().norm();
    if (moved_px < settled_px) break;
  }
  return patch.correlation(pixels);
}

}  // namespace

SlantedMatch refine_slanted(const cv::Mat& left, const Eigen::Vector2d& left_px, const cv::Mat& right,
                            const Eigen::Vector2d& right_px, std::span<const Eigen::Vector2d> likely_slopes) {
  SlantedMatch unchanged{right_px};
  if (!inside(left, left_px.x(), left_px.y(), kWindowRadius_px + 1)) return unchanged;
  const SlantedTemplate patch(left, left_px.cast<float>());
  const RightPlace place{right, right_px.cast<float>()};
  Parameters parameters = Parameters::Zero();
  SlopePrior prior;
  if (!settle(patch, place, prior, kRoughly_px, parameters)) return unchanged;
  if (const auto covariance = patch.slope_covariance()) {
    prior = likely_surface(parameters.tail<2>(), *covariance, likely_slopes).value_or(prior);
  }
  const auto correlation = settle(patch, place, prior, kSettled_px, parameters);
  if (!correlation) return unchanged;
  return {(place.start_px + parameters.head<2>()).cast<double>(), parameters.tail<2>().cast<double>(),
          *correlation};
}

}  // namespace stereo_slam
