// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/distributions/gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Sigma points of a Gaussian.
namespace antipode {

/// The rule for N(0, I) carried to a Gaussian: mean + L g_k. Mean and covariance are exact.
template <GaussianRule Rule, std::floating_point Scalar>
[[nodiscard]] WeightedSamples<Scalar, Rule::kDim, Rule::kCount> sample(
    const Rule& rule, const Gaussian<Scalar, Rule::kDim>& gaussian) {
  auto samples = rule.template standard<Scalar>();
  for (int k = 0; k < samples.size(); ++k) {
    const Vector<Scalar, Rule::kDim> g = samples.points.col(k);
    const Vector<Scalar, Rule::kDim> x = gaussian.mean() + gaussian.sqrt_factor() * g;
    samples.points.col(k) = x;
  }
  return samples;
}

}  // namespace antipode
