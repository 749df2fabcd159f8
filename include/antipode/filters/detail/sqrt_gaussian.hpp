// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/solve.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>

/// Conditioning a concentrated density on a quadratic log-likelihood, in whitened coordinates y: the state is
/// Chart::retract(mean, L y) with y ~ N(0, I).
namespace antipode::detail {

/// l(y) = constant + gradient.y - y^T curvature y/2, with a positive semidefinite curvature.
template <class Scalar, int N>
struct QuadraticLogLikelihood {
  Scalar constant = Scalar(0);
  Vector<Scalar, N> gradient = Vector<Scalar, N>::Zero();
  Matrix<Scalar, N> curvature = Matrix<Scalar, N>::Zero();

  [[nodiscard]] QuadraticLogLikelihood scaled(Scalar power) const {
    return {power * constant, power * gradient, power * curvature};
  }
};

/// A Gaussian N(mean, root root^T), the evidence of the measurement that made it, and its innovation squared.
template <class Scalar, int N>
struct ConditionedGaussian {
  Vector<Scalar, N> mean;
  Matrix<Scalar, N> root;
  Scalar log_evidence;
  Scalar nis;  ///< least over the states of: squared distance from the prior - 2 l

  [[nodiscard]] bool finite() const { return all_finite(mean) && all_finite(root) && std::isfinite(nis); }
};

/// N(mean, L L^T) times exp(l), normalised. NaN if l is too large to compute with.
template <class Scalar, int N>
[[nodiscard]] ConditionedGaussian<Scalar, N> condition(const Vector<Scalar, N>& mean,
                                                       const Matrix<Scalar, N>& L,
                                                       const QuadraticLogLikelihood<Scalar, N>& l) {
  using std::log;
  const Matrix<Scalar, N> Lt = L.transpose();
  const Matrix<Scalar, N> H = congruence<Scalar, N, N>(Lt, l.curvature);
  // No pivot of I + H is below one; rounding may violate that for a steep likelihood.
  const Matrix<Scalar, N> C =
      cholesky_factor<Scalar, N>(Matrix<Scalar, N>::Identity() + H, Scalar(1))
          .value_or(Matrix<Scalar, N>::Constant(std::numeric_limits<Scalar>::quiet_NaN()));
  const Matrix<Scalar, N> root = solve_lower<Scalar, N, N>(C, Lt).transpose();
  const Vector<Scalar, N> H_mean = l.curvature * mean;
  const Vector<Scalar, N> slope = l.gradient - H_mean;
  const Vector<Scalar, N> step = root.transpose() * slope;
  // log of prior times likelihood over posterior at the posterior's mean, where no large terms cancel.
  const Vector<Scalar, N> posterior_mean = mean + root * step;
  const Vector<Scalar, N> from_prior = solve_lower_transposed<Scalar, N, 1>(C, step);
  const Vector<Scalar, N> H_posterior = l.curvature * posterior_mean;
  const Scalar log_peak = l.constant + posterior_mean.dot(l.gradient) -
                          Scalar(0.5) * (posterior_mean.dot(H_posterior) + from_prior.squaredNorm());
  Scalar log_evidence = log_peak;
  for (int i = 0; i < N; ++i) log_evidence -= log(C(i, i));
  return {posterior_mean, root, log_evidence, Scalar(0) - Scalar(2) * log_peak};
}

/// A concentrated density with a root L of its covariance, covariance = L L^T: a prior, or a density on the
/// way from it to a posterior.
///
/// The latter is a Gaussian in the whitened coordinates of the prior, whose chart does not move. There the
/// prior stays N(0, I), also if its covariance is singular or nearly so: no update divides by L.
template <ConcentratedDensity Density_>
struct SqrtGaussian {
  using Density = Density_;
  using Chart = typename Density::Chart;
  using Scalar = typename Density::Scalar;
  static constexpr int kDim = Chart::kDim;
  using Tangent = Vector<Scalar, kDim>;
  using Square = Matrix<Scalar, kDim>;

  typename Chart::Point mean;
  Square L;
  Tangent whitened_mean = Tangent::Zero();    ///< in the coordinates of the prior
  Square whitened_root = Square::Identity();  ///< of the covariance there

  /// Throws unless the density is finite with a positive semidefinite covariance.
  [[nodiscard]] static SqrtGaussian of(const Density& density) {
    const auto& [mean, covariance] = density;
    Chart::require_finite(mean);
    return {mean, root_of(density).L};
  }

  /// Whether the squares of all samples within ten standard deviations are finite.
  [[nodiscard]] bool has_finite_samples() const { return std::isfinite(Scalar(100) * L.squaredNorm()); }

  /// The point with the whitened coordinates y.
  [[nodiscard]] typename Chart::Point at(const Tangent& y) const {
    const Tangent xi = L * y;
    return Chart::retract(mean, xi);
  }

  /// The density of Chart::retract(mean, L y) for y of the given Gaussian, to first order: the mean moves,
  /// and with it the tangent space. Nothing if y leads out of the prior's chart (more than half a turn away,
  /// say) or overflows.
  [[nodiscard]] std::optional<SqrtGaussian> moved(const SqrtGaussian& prior,
                                                  const ConditionedGaussian<Scalar, kDim>& y) const {
    SqrtGaussian result;
    result.whitened_mean = whitened_mean + whitened_root * y.mean;
    result.whitened_root = whitened_root * y.root;
    const Tangent xi = prior.L * result.whitened_mean;
    const Square root = prior.L * result.whitened_root;
    const bool reachable = std::isfinite(xi.squaredNorm()) && Chart::contains(xi);
    if (!reachable || !std::isfinite(root.squaredNorm())) return std::nullopt;
    result.mean = Chart::normalized(Chart::retract(prior.mean, xi));
    result.L = Chart::jacobian(xi) * root;
    if (!result.has_finite_samples()) return std::nullopt;
    return result;
  }

  /// This density with its coordinates in another prior, whose L must be invertible.
  [[nodiscard]] SqrtGaussian seen_from(const SqrtGaussian& prior) const {
    SqrtGaussian result = *this;
    const Tangent xi = Chart::local(prior.mean, mean);
    const Square root = Chart::jacobian_inverse(xi) * L;
    result.whitened_mean = solve<Scalar, kDim, 1>(prior.L, xi);
    result.whitened_root = solve<Scalar, kDim, kDim>(prior.L, root);
    return result;
  }

  /// The prior times exp(l), normalised. Both l and the result are in the coordinates y of this density.
  [[nodiscard]] ConditionedGaussian<Scalar, kDim> condition_prior(
      const QuadraticLogLikelihood<Scalar, kDim>& l) const {
    return condition<Scalar, kDim>(-solve<Scalar, kDim, 1>(whitened_root, whitened_mean),
                                   solve<Scalar, kDim, kDim>(whitened_root, Square::Identity()), l);
  }

  [[nodiscard]] Density density() const { return {mean, L * L.transpose()}; }
};

}  // namespace antipode::detail
