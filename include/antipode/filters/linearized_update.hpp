// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <type_traits>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>
#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/update_status.hpp>
#include <antipode/weighted_samples.hpp>

/// Bayes update of a concentrated pose density by measurements z_i = h_i(x) + v_i, v_i ~ N(0, R_i), through
/// linear models of h (iterated posterior linearisation).
///
/// Each iteration regresses every h_i on the points of a sigma point rule over the current density, h_i ~
/// mean_i + A_i y + e_i with Cov(e_i) = Omega_i, and conditions the original prior on these linear models
/// with the noise R_i + Omega_i. No derivatives are needed. It is the cheapest update where the noise is
/// Gaussian and h, R are known. Any other likelihood, and data with outliers, are for quadratic_update.
/// Reference: Garcia-Fernandez, Svensson, Morelande, Sarkka, "Posterior linearization filter: principles and
/// implementation using sigma points", 2015.
namespace antipode {

/// Measurements by index: a vector, array or span of NoisyMeasurement.
template <class Measurements>
concept IndexedMeasurements = requires(const Measurements& measurements, std::size_t i) {
  { measurements.size() } -> std::convertible_to<std::size_t>;
  measurements[i].z;
  measurements[i].R;
};

/// How much a measurement of squared Mahalanobis distance d^2 counts.
///
/// Weights keep the estimate from a few outliers among many measurements; the covariance is NOT right with
/// them, and it does not say so. Huber's is overconfident wherever there are outliers (ANEES 30 to 1e6
/// instead of 6), Cauchy's with fewer than a hundred measurements under a wide prior (up to 1e5). For
/// outliers use RobustMeasurements (robust_likelihood.hpp) with quadratic_update, whose covariance is right;
/// docs/results/consistency.md compares them.
enum class RobustWeight {
  kNone,    ///< 1
  kHuber,   ///< scale/d beyond the scale: bounds the pull of an outlier, does not remove it
  kCauchy,  ///< 1/(1 + d^2/scale^2)
};

template <std::floating_point Scalar>
struct LinearizedUpdateOptions {
  /// Most regressions. If the last one still moves the mean by more than settled_step, the result is
  /// reported as diverged.
  int max_iterations = 20;
  /// An iteration that moves the mean by less, in standard deviations of the density, is the last.
  Scalar tolerance = Scalar(0.01);
  Scalar settled_step = Scalar(0.2);
  /// A posterior with a larger residual, the root of the sum of tr(R^-1 Omega_i), is reported as
  /// kNotGaussian. Its covariance contains the Omega_i and is as large as the error on average, but large
  /// errors are more frequent than a Gaussian's.
  Scalar max_final_residual = Scalar(4);
  RobustWeight robust = RobustWeight::kNone;
  /// Distance at which a measurement begins to count less. It is compared with S_i, which includes the spread
  /// of the current density: a wide prior condemns nothing.
  Scalar robust_scale = Scalar(2.8);
};

namespace detail {

template <class Scalar>
[[nodiscard]] Scalar robust_weight(RobustWeight kind, Scalar squared_distance, Scalar scale) {
  using std::sqrt;
  const Scalar ratio = squared_distance / (scale * scale);
  if (kind == RobustWeight::kHuber) return ratio > Scalar(1) ? Scalar(1) / sqrt(ratio) : Scalar(1);
  if (kind == RobustWeight::kCauchy) return Scalar(1) / (Scalar(1) + ratio);
  return Scalar(1);
}

/// The measurements over a density: their joint log-likelihood in its coordinates y, with linear models.
template <class Scalar, int N>
struct Linearization {
  QuadraticLogLikelihood<Scalar, N> model;
  Scalar residual = 0;  ///< sum of tr(R_i^-1 Omega_i)
  int used = 0;         ///< measurements that can be made at every sample
  bool finite = true;
};

/// One measurement over a density: z = mean + A y + e with Cov(e) = disturbance.
template <class Scalar, int Dim, int N>
struct LinearMeasurementModel {
  Vector<Scalar, Dim> mean;
  Matrix<Scalar, Dim, N> A;
  Matrix<Scalar, Dim> disturbance;
};

/// The regression of predicted measurements, one a column, on the sigma points that they were predicted at.
template <class Scalar, int Dim, int N, int Count>
[[nodiscard]] LinearMeasurementModel<Scalar, Dim, N> regress_on_points(
    const Matrix<Scalar, Dim, Count>& predicted, const WeightedSamples<Scalar, N, Count>& standard) {
  using Z = Vector<Scalar, Dim>;
  LinearMeasurementModel<Scalar, Dim, N> model{Z::Zero(), Matrix<Scalar, Dim, N>::Zero(),
                                               Matrix<Scalar, Dim>::Zero()};
  for (int k = 0; k < Count; ++k) model.mean += standard.weights[k] * predicted.col(k);
  for (int k = 0; k < Count; ++k) {
    add_outer_product<Scalar, Dim, N>(standard.weights[k], predicted.col(k) - model.mean,
                                      standard.points.col(k), model.A);
  }
  for (int k = 0; k < Count; ++k) {
    const Z error = predicted.col(k) - model.mean - model.A * standard.points.col(k);
    add_outer_product(standard.weights[k], error, error, model.disturbance);
  }
  return model;
}

/// Adds the log-likelihood of one measurement; sets `finite` to false where its numbers are not.
template <class Scalar, int Dim, int N>
void add_measurement(const Vector<Scalar, Dim>& z, const Matrix<Scalar, Dim>& R,
                     const LinearMeasurementModel<Scalar, Dim, N>& h,
                     const LinearizedUpdateOptions<Scalar>& options, Linearization<Scalar, N>& sum) {
  using Square = Matrix<Scalar, Dim>;
  using std::log;
  const Vector<Scalar, Dim> innovation = z - h.mean;
  const Square noise = R + h.disturbance;
  const auto R_root = cholesky_factor<Scalar, Dim>(R);
  const auto noise_root = cholesky_factor(noise);
  if (!innovation.allFinite() || !R_root || !noise_root) {
    sum.finite = false;
    return;
  }
  Scalar weight(1);
  if (options.robust != RobustWeight::kNone) {
    const Square S = noise + scaled_square<Scalar, Dim, N>(h.A, Vector<Scalar, N>::Ones());
    const auto S_root = cholesky_factor(S);
    const Scalar distance =
        S_root ? solve_lower(*S_root, innovation).squaredNorm() : std::numeric_limits<Scalar>::infinity();
    weight = robust_weight(options.robust, distance, options.robust_scale);
  }
  const Vector<Scalar, Dim> whitened = solve_lower(*noise_root, innovation);
  const Matrix<Scalar, N, Dim> slope = solve_lower(*noise_root, h.A).transpose();
  sum.model.gradient += weight * (slope * whitened);
  sum.model.curvature += scaled_square<Scalar, N, Dim>(slope, Vector<Scalar, Dim>::Constant(weight));
  sum.model.constant -= Scalar(0.5) * weight * whitened.squaredNorm();
  for (int j = 0; j < Dim; ++j) sum.model.constant -= log((*noise_root)(j, j) / (*R_root)(j, j));
  const Square R_inverse_root = solve_lower<Scalar, Dim, Dim>(*R_root, Square::Identity());
  sum.residual += congruence<Scalar, Dim, Dim>(R_inverse_root, h.disturbance).trace();
}

template <class Density, class Measurements, class Model, int N, int Count>
[[nodiscard]] auto linearize(const SqrtGaussian<Density>& density, const Measurements& measurements,
                             const Model& h,
                             const WeightedSamples<typename Density::Scalar, N, Count>& standard,
                             const LinearizedUpdateOptions<typename Density::Scalar>& options) {
  using Scalar = typename Density::Scalar;
  using Z = std::remove_cvref_t<decltype(measurements[0].z)>;
  constexpr int kDim = Z::RowsAtCompileTime;
  std::array<typename Density::Chart::Point, static_cast<std::size_t>(Count)> states;
  for (std::size_t k = 0; k < Count; ++k) states[k] = density.at(standard.points.col(static_cast<int>(k)));
  Linearization<Scalar, N> sum;
  Matrix<Scalar, kDim, Count> predicted;
  const std::size_t count = measurements.size();
  for (std::size_t i = 0; i < count && sum.finite; ++i) {
    bool measurable = true;
    for (std::size_t k = 0; k < Count && measurable; ++k) {
      const std::optional<Z> z = h(states[k], i);
      measurable = z.has_value();
      if (measurable) predicted.col(static_cast<int>(k)) = *z;
    }
    if (!measurable) continue;
    ++sum.used;
    const auto& measurement = measurements[i];
    add_measurement<Scalar, kDim, N>(measurement.z, measurement.R,
                                     regress_on_points<Scalar, kDim, N, Count>(predicted, standard), options,
                                     sum);
  }
  return sum;
}

template <class Scalar>
void check_options(const LinearizedUpdateOptions<Scalar>& options) {
  if (options.max_iterations < 1) [[unlikely]] {
    throw_invalid("max_iterations is not positive", options.max_iterations);
  }
  if (!(options.tolerance > Scalar(0))) [[unlikely]] {
    throw_invalid("tolerance is not positive", options.tolerance);
  }
  if (!(options.settled_step > Scalar(0))) [[unlikely]] {
    throw_invalid("settled_step is not positive", options.settled_step);
  }
  if (!(options.max_final_residual > Scalar(0))) [[unlikely]] {
    throw_invalid("max_final_residual is not positive", options.max_final_residual);
  }
  if (!(options.robust_scale > Scalar(0))) [[unlikely]] {
    throw_invalid("robust_scale is not positive", options.robust_scale);
  }
}

}  // namespace detail

/// The posterior of `prior` and independent measurements, a std::vector of NoisyMeasurement, say.
///
/// h(pose, i) predicts the i-th, as a vector or a std::optional of one. A measurement that cannot be
/// predicted at some sigma point, a landmark behind the camera say, is left out of that iteration. With a
/// singular covariance of the pose there is one iteration only. Throws on
/// invalid options and covariances of the pose; a measurement that is not finite or whose R is not positive
/// definite comes back as kNotFinite, none that can be predicted as kNoSupport, both with the prior.
template <ConcentratedDensity Density, IndexedMeasurements Measurements, class Model,
          GaussianRule Rule = CubatureRule<Density::Chart::kDim>>
requires(Rule::kDim == Density::Chart::kDim) [[nodiscard]] UpdateResult<Density> linearized_update(
    const Density& prior, const Measurements& measurements, const Model& h,
    const LinearizedUpdateOptions<typename Density::Scalar>& options = {}, const Rule& rule = {}) {
  using Scalar = typename Density::Scalar;
  constexpr int N = Density::Chart::kDim;
  detail::check_options(options);
  const auto origin = detail::SqrtGaussian<Density>::of(prior);
  // Conditioning the prior again and again takes its inverse.
  const int max_iterations = origin.invertible ? options.max_iterations : 1;
  UpdateResult<Density> result{.posterior = prior};
  if (measurements.size() == 0) return result;
  Scalar last_step(0);
  result.limit_hit = origin.invertible;
  const auto standard = rule.template standard<Scalar>();
  detail::SqrtGaussian<Density> density = origin;
  do {
    const auto fit = detail::linearize(density, measurements, h, standard, options);
    result.evaluations += Rule::kCount;
    if (!fit.finite) {
      result.status = UpdateStatus::kNotFinite;
      return result;
    }
    if (fit.used == 0) {
      result.status = UpdateStatus::kNoSupport;
      return result;
    }
    const auto y = result.steps == 0 ? detail::condition<Scalar, N>(Vector<Scalar, N>::Zero(),
                                                                    Matrix<Scalar, N>::Identity(), fit.model)
                                     : density.condition_prior(origin, fit.model);
    if (!y.finite() || !std::isfinite(y.log_evidence)) {
      result.status = UpdateStatus::kNotFinite;
      return result;
    }
    const auto moved = density.moved(y);
    if (!moved) {
      result.status = UpdateStatus::kDiverged;
      return result;
    }
    density = *moved;
    ++result.steps;
    result.log_evidence = y.log_evidence;
    result.log_likelihood = fit.model.constant;
    result.residual = std::sqrt(fit.residual);
    // Steps are measured in the density that the iteration started from, once that is the posterior's size.
    last_step = result.steps > 1 ? y.mean.norm() : std::numeric_limits<Scalar>::infinity();
    result.limit_hit = origin.invertible && !(last_step <= options.tolerance);
  } while (result.limit_hit && result.steps < max_iterations);
  if (!origin.invertible) {  // the only linear models were those over the prior
    const auto fit = detail::linearize(density, measurements, h, standard, options);
    result.evaluations += Rule::kCount;
    result.residual =
        fit.finite && fit.used > 0 ? std::sqrt(fit.residual) : std::numeric_limits<Scalar>::infinity();
  }
  const bool settled = !result.limit_hit || last_step <= options.settled_step;
  const bool explained = result.residual <= options.max_final_residual;
  if (!explained) result.status = UpdateStatus::kNotGaussian;
  if (!settled) result.status = UpdateStatus::kDiverged;
  result.posterior = density.density();
  return result;
}

}  // namespace antipode
