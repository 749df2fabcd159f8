// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>

#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/progression.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>
#include <antipode/filters/log_likelihood.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/weighted_samples.hpp>

/// Quadratic models of a log-likelihood over a density.
namespace antipode::detail {

/// The quadratic model of a log-likelihood over a density.
template <class Scalar, int N>
struct QuadraticFit {
  QuadraticLogLikelihood<Scalar, N> model;
  Scalar mean = 0;         ///< of the log-likelihood
  Scalar residual = 0;     ///< standard deviation of what the model leaves unexplained
  Scalar explained = 0;    ///< standard deviation of the quadratic
  Scalar dropped = 0;      ///< standard deviation of the part that curves upwards, which the model leaves out
  LogRange<Scalar> range;  ///< the rest is set only if it is valid and supported
};

/// The log-likelihood at the whitened coordinates `points`, one per column.
template <class Density, class L, int N, int Count>
void evaluate_over(const SqrtGaussian<Density>& density, L& log_likelihood,
                   const Matrix<typename Density::Scalar, N, Count>& points,
                   Vector<typename Density::Scalar, Count>& values) {
  using Scalar = typename Density::Scalar;
  if constexpr (std::same_as<typename Density::Chart::Point, DualQuaternion<Scalar>>) {
    Matrix<Scalar, 8, Count> poses;
    for (int k = 0; k < Count; ++k) poses.col(k) = density.at(points.col(k)).coeffs();
    evaluate_log_likelihood(log_likelihood, poses, values);
  } else {
    for (int k = 0; k < Count; ++k) values[k] = log_likelihood(density.at(points.col(k)));
  }
}

/// Evaluates the likelihood at the points of a rule for N(0, spread^2 I) in the density's coordinates y and
/// projects it onto Hermite polynomials.
template <class Density, class L, int N, int Count>
[[nodiscard]] auto fit_quadratic(const SqrtGaussian<Density>& density, typename Density::Scalar spread,
                                 L& log_likelihood,
                                 const WeightedSamples<typename Density::Scalar, N, Count>& standard) {
  using Scalar = typename Density::Scalar;
  using std::sqrt;
  Vector<Scalar, Count> values;
  evaluate_over<Density>({density.mean, spread * density.L}, log_likelihood, standard.points, values);
  QuadraticFit<Scalar, N> fit;
  fit.range = bound_log_likelihoods(standard.weights, values);
  if (!fit.range.valid || !fit.range.supported()) return fit;

  const Scalar mean = standard.weights.dot(values);
  fit.mean = mean;
  Vector<Scalar, Count> errors;
  for (int k = 0; k < Count; ++k) errors[k] = values[k] - mean;
  Matrix<Scalar, N> hessian = Matrix<Scalar, N>::Zero();
  Vector<Scalar, N> gradient = Vector<Scalar, N>::Zero();
  for (int k = 0; k < Count; ++k) {
    const Vector<Scalar, N> y = standard.points.col(k);
    const Scalar weighted = standard.weights[k] * errors[k];
    for (int i = 0; i < N; ++i) gradient[i] += weighted * y[i];
    add_outer_product(weighted, y, y, hessian);
  }
  fit.explained = sqrt(gradient.squaredNorm() + Scalar(0.5) * hessian.squaredNorm());
  for (int k = 0; k < Count; ++k) {
    const Vector<Scalar, N> y = standard.points.col(k);
    const Vector<Scalar, N> hessian_y = hessian * y;
    errors[k] -= y.dot(gradient) + Scalar(0.5) * (y.dot(hessian_y) - hessian.trace());
  }
  fit.residual = sqrt(standard.weights.dot(errors.cwiseAbs2()));
  const Matrix<Scalar, N> curvature = without_negative_eigenvalues<Scalar, N>(-hessian);
  fit.dropped = sqrt(Scalar(0.5) * (curvature + hessian).squaredNorm());
  fit.model = {mean + Scalar(0.5) * curvature.trace(), gradient / spread, curvature / (spread * spread)};
  return fit;
}

}  // namespace antipode::detail
