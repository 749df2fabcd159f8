// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/quadratic_fit.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>
#include <antipode/filters/log_likelihood.hpp>
#include <antipode/weighted_samples.hpp>

/// The check of a quadratic model at other points than those that it was fitted to.
namespace antipode::detail {

/// Points for N(0, I): the centre, and M corners (+-1, ..., +-1) on each of two spheres. The corners are the
/// columns of a Hadamard matrix, so that their mean is zero and their second moments are those of the sphere;
/// the outer ones are the negatives. For functions of the radius r exact up to r^8 (Gauss-Radau quadrature).
template <int N>
struct CheckPoints {
  static constexpr int kCorners = static_cast<int>(std::bit_ceil(static_cast<unsigned>(N) + 1));  ///< M
  static constexpr int kCount = 1 + 2 * kCorners;

  /// 0 for the centre, 1 and 2 for the spheres.
  [[nodiscard]] static constexpr int sphere(int k) { return (k + kCorners - 1) / kCorners; }

  template <class Scalar>
  [[nodiscard]] static WeightedSamples<Scalar, N, kCount> standard() {
    using std::sqrt;
    constexpr Scalar n(N), centre = n + 4;
    const Scalar half_gap = sqrt(2 * centre);
    const Scalar inner = centre - half_gap, outer = centre + half_gap;  // r^2
    const Scalar inner_weight = n * (outer - n - 2) / (inner * (outer - inner));
    const Scalar outer_weight = n * (n + 2 - inner) / (outer * (outer - inner));
    WeightedSamples<Scalar, N, kCount> samples;
    samples.points.col(0).setZero();
    samples.weights[0] = 1 - inner_weight - outer_weight;
    for (int k = 0; k < kCorners; ++k) {
      for (int i = 0; i < N; ++i) {
        const bool negative = std::popcount(static_cast<unsigned>((i + 1) & k)) % 2 == 1;
        const Scalar sign = negative ? Scalar(-1) : Scalar(1);
        samples.points(i, 1 + k) = sign * sqrt(inner / n);
        samples.points(i, 1 + kCorners + k) = -sign * sqrt(outer / n);
      }
      samples.weights[1 + k] = inner_weight / Scalar(kCorners);
      samples.weights[1 + kCorners + k] = outer_weight / Scalar(kCorners);
    }
    return samples;
  }
};

/// The log-likelihood at the check points in blocks of Count, for likelihoods that take no other number.
template <int Count, class Density, class L, int N, int All>
void evaluate_in_blocks(const SqrtGaussian<Density>& density, L& log_likelihood,
                        const Matrix<typename Density::Scalar, N, All>& points,
                        Vector<typename Density::Scalar, All>& values) {
  if constexpr (LogLikelihoodOver<L, Density, All>) {
    evaluate_over(density, log_likelihood, points, values);
  } else {
    for (int first = 0; first < All; first += Count) {
      Matrix<typename Density::Scalar, N, Count> block;
      Vector<typename Density::Scalar, Count> found;
      for (int k = 0; k < Count; ++k) block.col(k) = points.col(std::min(first + k, All - 1));
      evaluate_over(density, log_likelihood, block, found);
      for (int k = first; k < std::min(first + Count, All); ++k) values[k] = found[k - first];
    }
  }
}

/// What a model leaves unexplained over a density.
template <class Scalar>
struct Misfit {
  Scalar total = std::numeric_limits<Scalar>::infinity();  ///< standard deviation
  /// Standard deviation of the means over the spheres. Most rules have their points on one sphere, on which
  /// every function of the radius is quadratic: a fit to them does not show this part.
  Scalar radial = std::numeric_limits<Scalar>::infinity();
};

/// The misfit over y of `model`; both are in the whitened coordinates of `density`. Infinite if a
/// log-likelihood is, or if y reaches too far to compute with. Count is the number of points that the
/// likelihood takes at once.
template <int Count, class Density, class L, int N = Density::Chart::kDim>
[[nodiscard]] auto misfit(const SqrtGaussian<Density>& density,
                          const ConditionedGaussian<typename Density::Scalar, N>& y,
                          const QuadraticLogLikelihood<typename Density::Scalar, N>& model,
                          L& log_likelihood) {
  using Scalar = typename Density::Scalar;
  using Check = CheckPoints<N>;
  const auto standard = Check::template standard<Scalar>();
  Matrix<Scalar, N, Check::kCount> points;
  Vector<Scalar, Check::kCount> errors;
  for (int k = 0; k < Check::kCount; ++k) {
    const Vector<Scalar, N> at = standard.points.col(k);
    points.col(k) = y.mean + y.root * at;
    const Vector<Scalar, N> point = points.col(k), tangent = density.L * point;
    if (!std::isfinite(tangent.squaredNorm())) return Misfit<Scalar>{};
  }
  evaluate_in_blocks<Count>(density, log_likelihood, points, errors);

  // Differences from the value at the mean: the values may be large.
  const Vector<Scalar, N> bend = model.curvature * y.mean, slope = model.gradient - bend;
  const Scalar centre = errors[0];
  Scalar mean(0);
  Vector<Scalar, 3> means = Vector<Scalar, 3>::Zero(), weights = Vector<Scalar, 3>::Zero();
  for (int k = 0; k < Check::kCount; ++k) {
    const Vector<Scalar, N> at = standard.points.col(k), step = y.root * at;
    const Vector<Scalar, N> step_bend = model.curvature * step;
    errors[k] -= centre + step.dot(slope) - Scalar(0.5) * step.dot(step_bend);
    const Scalar weighted = standard.weights[k] * errors[k];
    mean += weighted;
    means[Check::sphere(k)] += weighted;
    weights[Check::sphere(k)] += standard.weights[k];
  }
  Scalar total(0), radial(0);
  for (int k = 0; k < Check::kCount; ++k) {
    const Scalar error = errors[k] - mean;
    total += standard.weights[k] * error * error;
  }
  for (int sphere = 0; sphere < 3; ++sphere) {
    const Scalar error = means[sphere] / weights[sphere] - mean;
    radial += weights[sphere] * error * error;
  }
  return std::isfinite(total) ? Misfit<Scalar>{std::sqrt(total), std::sqrt(radial)} : Misfit<Scalar>{};
}

}  // namespace antipode::detail
