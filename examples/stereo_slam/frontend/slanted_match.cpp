// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/slanted_match.hpp"

#include <cmath>
#include <optional>

#include <Eigen/LU>

#include "stereo_slam/frontend/bilinear.hpp"
#include "stereo_slam/frontend/slanted_template.hpp"

namespace stereo_slam {
namespace {

constexpr int kWindowRadius_px = SlantedTemplate::kRadius_px;
constexpr float kGreySigma = 4.0F;  // grey levels: noise, and differences that a plane does not explain
constexpr int kMaxSteps = 8;
constexpr float kSettled_px = 0.01F;
constexpr float kRoughly_px = 0.05F;  // settled enough to choose a prior
constexpr float kMaxDrift_px = 2.0F;
constexpr float kMaxSlope = 1.0F;
constexpr double kRounding_px = 1e-3;  // of positions in single precision

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

/// Covariance of the slope from the texture alone; nothing if the texture does not determine the slope.
[[nodiscard]] std::optional<Eigen::Matrix2f> slope_covariance(const SlantedTemplate& patch) {
  const Eigen::Matrix4f& H = patch.information();
  const auto definite = [](const Eigen::Matrix2f& A) { return A(0, 0) > 0.0F && A.determinant() > 0.0F; };
  const Eigen::Matrix2f of_shift = H.topLeftCorner<2, 2>();
  if (!definite(of_shift)) return std::nullopt;
  const Eigen::Matrix2f both = H.topRightCorner<2, 2>();
  const Eigen::Matrix2f of_slope = H.bottomRightCorner<2, 2>() - both.transpose() * of_shift.inverse() * both;
  if (!definite(of_slope)) return std::nullopt;
  const Eigen::Matrix2f covariance = kGreySigma * kGreySigma * of_slope.inverse();
  if (!covariance.allFinite()) return std::nullopt;
  return covariance;
}

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
  const Eigen::Matrix4f inverse_hessian = (patch.information() + prior.information()).inverse();
  double correlation = 0.0;
  for (int iteration = 0; iteration < kMaxSteps; ++iteration) {
    const Eigen::Vector2f centre = right.start_px + parameters.head<2>();
    const Eigen::Vector2f slope = parameters.tail<2>();
    const double reach_px =
        kWindowRadius_px * (1.0 + static_cast<double>(slope.cwiseAbs().sum())) + kRounding_px;
    if (!inside(right.image, static_cast<double>(centre.x()), static_cast<double>(centre.y()), reach_px)) {
      return std::nullopt;
    }
    const auto compared = patch.compare(right.image, centre, slope);
    if (!(compared.gain > 0.0F)) return std::nullopt;
    correlation = static_cast<double>(compared.correlation);
    Parameters from_prior = parameters;
    from_prior.tail<2>() -= prior.mean;
    const Parameters change =
        inverse_hessian * (compared.gradient / compared.gain + prior.information() * from_prior);
    parameters -= change;
    if (!(parameters.head<2>().norm() <= kMaxDrift_px) ||
        !(parameters.tail<2>().cwiseAbs().maxCoeff() <= kMaxSlope)) {
      return std::nullopt;
    }
    const float moved_px = change.head<2>().norm() + kWindowRadius_px * change.tail<2>().norm();
    if (moved_px < settled_px) break;
  }
  return correlation;
}

}  // namespace

SlantedMatch refine_slanted(const cv::Mat& left, const Eigen::Vector2d& left_px, const cv::Mat& right,
                            const Eigen::Vector2d& right_px, std::span<const Eigen::Vector2d> likely_slopes) {
  SlantedMatch unchanged{right_px};
  if (!inside(left, left_px.x(), left_px.y(), kWindowRadius_px + 1 + kRounding_px)) return unchanged;
  const SlantedTemplate patch(left, left_px.cast<float>());
  const RightPlace place{right, right_px.cast<float>()};
  Parameters parameters = Parameters::Zero();
  SlopePrior prior;
  if (!settle(patch, place, prior, kRoughly_px, parameters)) return unchanged;
  if (const auto covariance = slope_covariance(patch)) {
    prior = likely_surface(parameters.tail<2>(), *covariance, likely_slopes).value_or(prior);
  }
  const auto correlation = settle(patch, place, prior, kSettled_px, parameters);
  if (!correlation) return unchanged;
  return {(place.start_px + parameters.head<2>()).cast<double>(), parameters.tail<2>().cast<double>(),
          *correlation};
}

}  // namespace stereo_slam
