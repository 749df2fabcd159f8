// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Sigma points of a projected Gaussian.
namespace antipode {

/// The points of a rule for N(0, I) on R^6, projected; the columns [q; p]. For a push-forward density the
/// weights are those of the rule, and the points have its mean and covariance in tangent coordinates. For a
/// renormalised one the weights have the factor (1 + |u|^2)^-2, and the moments are right to the degree of
/// the rule.
template <GaussianRule Rule, std::floating_point Scalar, Projection kProjection>
requires(Rule::kDim == 6) [[nodiscard]] WeightedSamples<Scalar, 8, Rule::kCount> sample(
    const Rule& rule, const BasicProjectedGaussian<Scalar, kProjection>& density) {
  const auto standard = rule.template standard<Scalar>();
  WeightedSamples<Scalar, 8, Rule::kCount> samples;
  samples.weights = standard.weights;
  for (int k = 0; k < Rule::kCount; ++k) {
    const Vector6<Scalar> y = density.mean() + density.sqrt_factor() * standard.points.col(k);
    samples.points.col(k) = density.project(y).coeffs();
    if constexpr (kProjection == Projection::kRenormalized) {
      const Scalar stretch = Scalar(1) + y.template head<3>().squaredNorm();
      samples.weights[k] /= stretch * stretch;
    }
  }
  samples.weights /= samples.weights.sum();
  return samples;
}

}  // namespace antipode
