// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/solve.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/quadratic_fit.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>

/// The steps of quadratic_update.
namespace antipode::detail {

/// The last step of the progression: from where, by which model, and where it led.
template <class Density>
struct QuadraticStep {
  using Scalar = typename Density::Scalar;
  static constexpr int N = Density::Chart::kDim;

  SqrtGaussian<Density> density;
  QuadraticFit<Scalar, N> fit = {};
  Scalar power = Scalar(0);  ///< of the likelihood in the density
  Scalar next = Scalar(0);   ///< power that the whole step leads to
  ConditionedGaussian<Scalar, N> y = {};

  /// How far the mean log-likelihood after the step is below what the model predicted.
  [[nodiscard]] Scalar shortfall(const QuadraticFit<Scalar, N>& after, Scalar spread) const {
    if (!after.range.supported()) return std::numeric_limits<Scalar>::infinity();
    const Vector<Scalar, N> bend = fit.model.curvature * y.mean;
    const Matrix<Scalar, N> spread_bend = fit.model.curvature * y.root;
    const Scalar promised =
        fit.model.constant + y.mean.dot(fit.model.gradient) -
        Scalar(0.5) * (y.mean.dot(bend) + spread * spread * y.root.cwiseProduct(spread_bend).sum());
    return promised - after.mean;
  }
};

/// The Gaussian at the given share of the way from N(0, I) to y: information vector and matrix are
/// interpolated linearly, which is the weighted geometric mean of the densities.
template <class Scalar, int N>
[[nodiscard]] ConditionedGaussian<Scalar, N> damped(const ConditionedGaussian<Scalar, N>& y, Scalar share) {
  const Matrix<Scalar, N> inverse_root = solve<Scalar, N, N>(y.root, Matrix<Scalar, N>::Identity());
  const Matrix<Scalar, N> inverse_root_t = inverse_root.transpose();
  Matrix<Scalar, N> information = scaled_square<Scalar, N, N>(inverse_root_t, Vector<Scalar, N>::Ones());
  for (int j = 0; j < N; ++j) {
    for (int i = 0; i < N; ++i) information(i, j) *= share;
    information(j, j) += Scalar(1) - share;
  }
  const auto C = cholesky_factor<Scalar, N>(information);
  if (!C)
    return {Vector<Scalar, N>::Constant(std::numeric_limits<Scalar>::quiet_NaN()), y.root, y.log_evidence,
            y.nis};
  const Matrix<Scalar, N> root = solve_lower<Scalar, N, N>(*C, Matrix<Scalar, N>::Identity()).transpose();
  const Vector<Scalar, N> whitened_mean = inverse_root * y.mean;
  const Vector<Scalar, N> slope = share * (inverse_root_t * whitened_mean);
  const Vector<Scalar, N> step = root.transpose() * slope;
  return {root * step, root, y.log_evidence, y.nis};
}

/// Whether y lies within N(0, I): its mean is at most one standard deviation away, and its variances are at
/// most 1 on average, up to the tolerance.
template <class Scalar, int N>
[[nodiscard]] bool is_within(const ConditionedGaussian<Scalar, N>& y, Scalar tolerance) {
  return y.mean.squaredNorm() <= Scalar(1) && y.root.squaredNorm() <= Scalar(N) * (Scalar(1) + tolerance);
}

/// Whether conditioning left the density where it was, in its own whitened coordinates: the step of the mean
/// and the change of the covariance, as a root mean square over the coordinates, are within the tolerance. If
/// only one variance changes, it may change by sqrt(N) times the tolerance.
template <class Scalar, int N>
[[nodiscard]] bool is_settled(const ConditionedGaussian<Scalar, N>& y, Scalar tolerance) {
  const Matrix<Scalar, N> change =
      scaled_square<Scalar, N, N>(y.root, Vector<Scalar, N>::Ones()) - Matrix<Scalar, N>::Identity();
  const Scalar allowed = tolerance * tolerance;
  return y.mean.squaredNorm() <= allowed && change.squaredNorm() <= Scalar(N) * allowed;
}

}  // namespace antipode::detail
