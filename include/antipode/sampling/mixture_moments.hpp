// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <Eigen/Core>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/sampling/sample_projected_gaussian.hpp>

/// @file
/// The moments of a mixture of poses.
namespace antipode {

/// The density with the moments of the mixture, however widely its components are spread: the scatter of the
/// orientation, mean and covariance of the translation, and the correlation of both (see moment_match). Its
/// pose() is the mean of the mixture. Its covariance() is that of xi = (phi, rho) in pose() exp(xi).
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] BinghamGaussian<Scalar> moment_match(
    const Mixture<BasicProjectedGaussian<Scalar, kProjection>>& x,
    const MomentMatchOptions<Scalar>& options = {.min_eigenvalue = Scalar(1e-14)}) {
  using Rule = MysovskikhRule<6>;
  const auto count = static_cast<Eigen::Index>(x.size()) * Rule::kCount;
  Matrix<Scalar, 8, Eigen::Dynamic> points(8, count);
  Vector<Scalar, Eigen::Dynamic> weights(count);
  Eigen::Index first = 0;
  for (const auto& [weight, density] : x) {
    const auto samples = sample(Rule{}, density);
    points.template middleCols<Rule::kCount>(first) = samples.points;
    weights.template segment<Rule::kCount>(first) = weight * samples.weights;
    first += Rule::kCount;
  }
  return detail::match_moments<Scalar>(points, weights, options);
}

}  // namespace antipode
