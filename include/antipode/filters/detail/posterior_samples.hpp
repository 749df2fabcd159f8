// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>

#include <antipode/detail/cholesky.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/progression.hpp>
#include <antipode/filters/log_likelihood.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// What samples of a posterior say about it: the innovation, and how far the density is from prior times
/// likelihood.
namespace antipode::detail {

/// The normalised innovation squared from samples of the posterior: the prior's squared distance minus twice
/// the log-likelihood, where the squared distance from the posterior is zero. Both are nearly proportional,
/// also if the samples spread too little, so a straight line through them leads to that point.
template <class Scalar, int Count>
[[nodiscard]] Scalar innovation_squared(const BinghamGaussian<Scalar>& prior,
                                        const BinghamGaussian<Scalar>& posterior,
                                        const WeightedSamples<Scalar, 8, Count>& samples,
                                        const Vector<Scalar, Count>& log_likelihoods) {
  for (const auto* density : {&prior, &posterior}) {
    if (!cholesky_factor(density->conditional_covariance())) return Scalar(0);
  }
  const auto distance_squared = [](const BinghamGaussian<Scalar>& density, const auto& pose) {
    return Scalar(2) * (density.log_density(density.pose()) - density.log_density(pose));
  };
  Scalar weights(0), mean_x(0), mean_y(0), xx(0), xy(0);  // sums over the samples so far
  for (int k = 0; k < Count; ++k) {
    const Scalar weight = samples.weights[k];
    if (!(weight > Scalar(0))) continue;
    const auto pose = DualQuaternion<Scalar>::unchecked(samples.points.col(k));
    const Scalar x = distance_squared(posterior, pose);
    const Scalar y = distance_squared(prior, pose) - Scalar(2) * log_likelihoods[k];
    weights += weight;
    const Scalar change_x = x - mean_x;
    mean_x += change_x * weight / weights;
    xy += weight * change_x * (y - mean_y);
    mean_y += (y - mean_y) * weight / weights;
    xx += weight * change_x * (x - mean_x);
  }
  const Scalar slope = xx > Scalar(0) ? xy / xx : Scalar(1);
  return mean_y - slope * mean_x;
}

/// The standard deviation of log(prior likelihood / posterior) over the samples of the posterior; zero if the
/// prior's conditional covariance is singular, so that it has no density.
template <class Scalar, class L, class Rule>
[[nodiscard]] Scalar unexplained(const BinghamGaussian<Scalar>& prior, L& log_likelihood, const Rule& rule,
                                 const BinghamGaussian<Scalar>& posterior) {
  using std::sqrt;
  if (!cholesky_factor(prior.conditional_covariance())) return Scalar(0);
  if (!cholesky_factor(posterior.conditional_covariance())) return std::numeric_limits<Scalar>::infinity();
  const auto samples = sample(rule, posterior);
  Vector<Scalar, Rule::kCount> values;
  evaluate_log_likelihood(log_likelihood, samples.points, values);
  const LogRange<Scalar> range = bound_log_likelihoods(samples.weights, values);
  if (!range.valid || !range.supported()) return std::numeric_limits<Scalar>::infinity();
  for (int k = 0; k < Rule::kCount; ++k) {
    if (!(samples.weights[k] > Scalar(0))) continue;
    const auto pose = DualQuaternion<Scalar>::unchecked(samples.points.col(k));
    values[k] += prior.log_density(pose) - posterior.log_density(pose);
  }
  const Scalar mean = samples.weights.dot(values) / samples.weights.sum();
  const Vector<Scalar, Rule::kCount> errors = values.array() - mean;
  const Scalar variance = samples.weights.dot(errors.cwiseAbs2()) / samples.weights.sum();
  return std::isfinite(variance) ? sqrt(variance) : std::numeric_limits<Scalar>::infinity();
}

}  // namespace antipode::detail
