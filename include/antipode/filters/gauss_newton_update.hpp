// SPDX-License-Identifier: MIT
#pragma once

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
#include <antipode/filters/detail/measurement_iteration.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/update_status.hpp>

/// @file
/// Bayes update of a concentrated density by measurements z_i = h_i(x) + v_i, v_i ~ N(0, R_i), with the
/// Jacobians of h: the maximum of the posterior by Gauss-Newton (the iterated extended Kalman filter) and the
/// covariance by its curvature there.
///
/// If a model provides its Jacobian, this calls it a few times, and not for every sigma point of every
/// iteration. A sigma point check of the posterior at the end shows whether h is linear over it. Reference:
/// B. M. Bell and F. W. Cathey, "The iterated Kalman filter update as a Gauss-Newton method", 1993.
namespace antipode {

/// h(state, i, J) predicts the i-th measurement, as a vector or a std::optional of one, and sets J, Dim x N,
/// to its Jacobian: h(Chart::retract(state, a), i) = h(state, i) + J a to first order in a. If h(state, i) is
/// callable too, the check at the end uses it.
template <class Model, class Density, int Dim>
concept DifferentiableModel = requires(const Model& h, const typename Density::Chart::Point& state,
                                       std::size_t i,
                                       Matrix<typename Density::Scalar, Dim, Density::Chart::kDim>& J) {
  { h(state, i, J) } -> std::convertible_to<std::optional<Vector<typename Density::Scalar, Dim>>>;
};

/// When the iteration ends, and which results are reported as not to be trusted.
template <std::floating_point Scalar>
struct GaussNewtonOptions {
  /// Most evaluations of the model with its Jacobians.
  int max_iterations = 50;
  /// An iteration that moves the mean by less, in standard deviations of the posterior, is the last.
  Scalar tolerance = Scalar(1e-3);
  /// A posterior with a larger residual, the root of the sum of tr(R^-1 Omega_i) as in linearized_update, is
  /// reported as kNotGaussian. In trials, the mean NEES was at most 6.6 for residuals below 0.4.
  Scalar max_final_residual = Scalar(0.5);
  /// Whether to look for a second mode if the measurements are not linear over the prior, as in
  /// linearized_update. The test for linearity evaluates each model at the points of the check at the end.
  bool check_modes = true;
  /// Below this log-likelihood at the mean the result is reported as diverged.
  Scalar min_log_likelihood = -std::numeric_limits<Scalar>::infinity();
};

namespace detail {

template <class Scalar>
void check_options(const GaussNewtonOptions<Scalar>& options) {
  check_iteration_options(options);
  if (std::isnan(options.min_log_likelihood)) [[unlikely]] {
    throw_invalid("min_log_likelihood is not a number", options.min_log_likelihood);
  }
}

/// The log-likelihood of all measurements to second order about the density's mean, without the curvature of
/// h.
template <class Density, class Measurements, class Model>
[[nodiscard]] auto expand(const SqrtGaussian<Density>& density, const Measurements& measurements,
                          const Model& h) {
  using Scalar = typename Density::Scalar;
  using Z = std::remove_cvref_t<decltype(measurements[0].z)>;
  constexpr int kDim = Z::RowsAtCompileTime, N = Density::Chart::kDim;
  Linearization<Scalar, N> sum;
  Vector<Scalar, N> gradient = Vector<Scalar, N>::Zero();
  Matrix<Scalar, N> curvature = Matrix<Scalar, N>::Zero();
  Matrix<Scalar, kDim, N> J;
  const std::size_t count = measurements.size();
  for (std::size_t i = 0; i < count; ++i) {
    J.resize(measurements[i].z.rows(), N);
    const auto predicted = checked_prediction<Z>(measurements[i].z, h(density.mean, i, J));
    if (!predicted) continue;
    if (J.rows() != predicted->rows()) [[unlikely]] {
      throw_invalid("the Jacobian of the model has another number of rows than were measured", J.rows());
    }
    ++sum.used;
    const auto root = cholesky_factor<Scalar, kDim>(measurements[i].R);
    const Z innovation = measurements[i].z - *predicted;
    if (!root || !innovation.allFinite() || !J.allFinite()) {
      sum.finite = false;
      return sum;
    }
    const Z whitened = solve_lower<Scalar, kDim, 1>(*root, innovation);
    const Matrix<Scalar, N, kDim> slope = solve_lower<Scalar, kDim, N>(*root, J).transpose();
    gradient += slope * whitened;
    curvature += scaled_square<Scalar, N, kDim>(slope, Z::Ones(whitened.size()));
    sum.model.constant -= Scalar(0.5) * whitened.squaredNorm();
  }
  const Matrix<Scalar, N> Lt = density.L.transpose();
  sum.model.gradient = Lt * gradient;
  sum.model.curvature = congruence<Scalar, N, N>(Lt, curvature);
  return sum;
}

/// The iteration of gauss_newton_update: expand at the mean, condition the prior, move. If the posterior
/// became less likely, go back and repeat the step with half its length.
template <class Density, class Measurements, class Model>
class GaussNewtonIteration : MeasurementIteration<Density, Measurements, Model> {
  using Base = MeasurementIteration<Density, Measurements, Model>;
  using Base::N, Base::origin_, Base::density_, Base::measurements_, Base::h_, Base::result_, Base::fail;
  using typename Base::Scalar;
  using Rule = DefaultRule<N>;

 public:
  GaussNewtonIteration(const Density& prior, const Measurements& measurements, const Model& h,
                       const GaussNewtonOptions<Scalar>& options)
      : Base(prior, measurements, h), options_(options) {}

  [[nodiscard]] UpdateResult<Density> run() {
    if (!this->begins()) return result_;
    while (iterate()) {
    }
    return result_;
  }

 private:
  static constexpr Scalar kShortest = Scalar(1e-3);  // smallest share of a step

  /// Returns whether there is more to do.
  [[nodiscard]] bool iterate() {
    const auto fit = expand(density_, measurements_, h_);
    ++result_.evaluations;
    if (!fit.finite) return fail(UpdateStatus::kNotFinite);
    if (fit.used == 0) return fail(UpdateStatus::kNoSupport);
    const Scalar log_posterior = fit.model.constant - Scalar(0.5) * density_.whitened_mean.squaredNorm();
    if (result_.steps > 0 && log_posterior < last_log_posterior_ - kWorse && share_ > kShortest) {
      share_ /= Scalar(2);
      return step_back();
    }
    share_ = Scalar(1);
    last_ = density_;
    last_log_posterior_ = log_posterior;
    y_ = density_.condition_prior(fit.model);
    if (!y_.finite() || !std::isfinite(y_.log_evidence)) return fail(UpdateStatus::kNotFinite);
    result_.log_likelihood = fit.model.constant;
    result_.log_evidence = y_.log_evidence;
    result_.nis = y_.nis;
    return move();
  }

  [[nodiscard]] bool step_back() {
    density_ = last_;
    return move();
  }

  [[nodiscard]] bool move() {
    auto y = y_;
    y.mean *= share_;
    const auto moved = density_.moved(origin_, y);
    if (!moved) {
      if (share_ <= kShortest) return fail(UpdateStatus::kDiverged);
      share_ /= Scalar(2);
      return move();
    }
    // In the posterior's standard deviations: those of y.root.
    const Scalar step = solve<Scalar, N, 1>(y_.root, y.mean).norm();
    density_ = *moved;
    ++result_.steps;
    const bool settled = step <= options_.tolerance;
    if (!settled && result_.steps < options_.max_iterations) return true;
    result_.limit_hit = !settled;
    return finish();
  }

  [[nodiscard]] bool finish() {
    const auto values_of_h = [&](const typename Density::Chart::Point& state, std::size_t i) {
      using Z = std::remove_cvref_t<decltype(measurements_[0].z)>;
      if constexpr (requires { h_(state, i); }) {
        return std::optional<Z>(h_(state, i));
      } else {
        Matrix<Scalar, Z::RowsAtCompileTime, N> J(measurements_[i].z.rows(), N);
        return std::optional<Z>(h_(state, i, J));
      }
    };
    const auto standard = Rule{}.template standard<Scalar>();
    const auto over_posterior = linearize(density_, measurements_, values_of_h, standard, {});
    result_.evaluations += Rule::kCount;
    result_.residual = over_posterior.finite && over_posterior.used > 0
                           ? std::sqrt(over_posterior.residual)
                           : std::numeric_limits<Scalar>::infinity();
    result_.posterior = density_.density();
    if (result_.limit_hit || result_.log_likelihood < options_.min_log_likelihood) {
      result_.status = UpdateStatus::kDiverged;
    } else if (!(result_.residual <= options_.max_final_residual) || is_ambiguous(values_of_h, standard)) {
      result_.status = UpdateStatus::kNotGaussian;
    }
    return false;
  }

  template <class Values, class Standard>
  [[nodiscard]] bool is_ambiguous(const Values& h, const Standard& standard) {
    if (!options_.check_modes) return false;
    result_.evaluations += Standard::kCount;
    const auto over_prior = linearize(origin_, measurements_, h, standard, {});
    if (!over_prior.bent() && over_prior.used > 0) return false;
    const auto local_model = [&](const SqrtGaussian<Density>& density) {
      using Local = LocalModel<Scalar, N>;
      ++result_.evaluations;
      const auto fit = expand(density, measurements_, h_);
      return fit.finite && fit.used > 0 ? std::optional<Local>({fit.model, fit.model.constant})
                                        : std::nullopt;
    };
    MeasurementLikelihood<Density, Measurements, Values> likelihood{measurements_, h, result_.evaluations};
    return likelihood.has_second_mode(origin_, density_, result_.log_evidence, local_model);
  }

  static constexpr Scalar kWorse = Scalar(1e-3);  // decrease of the log posterior that takes the step back

  const GaussNewtonOptions<Scalar>& options_;
  SqrtGaussian<Density> last_ = origin_;  ///< where the last step started
  ConditionedGaussian<Scalar, N> y_ = {};
  Scalar last_log_posterior_ = -std::numeric_limits<Scalar>::infinity();
  Scalar share_ = Scalar(1);  ///< of the step that is taken
};

}  // namespace detail

/// The posterior of `prior` and independent measurements, as in linearized_update, with a model that provides
/// its Jacobians: h(state, i, J), see DifferentiableModel. The Jacobian is with respect to the vector in the
/// chart of the density: for a PoseGaussian in the screw chart, xi = (phi, rho) of x exp(xi).
///
/// A measurement that cannot be predicted is left out of that iteration. The covariance of the prior may be
/// singular. Throws on invalid options, on an invalid covariance of the prior, if R is not symmetric, and if
/// R, the prediction or J differs in length from z. The status is kNotFinite if a measurement is not finite
/// or its R not positive definite, and kNoSupport if no measurement can be predicted; the posterior then is
/// the prior.
template <ConcentratedDensity Density, IndexedMeasurements Measurements, class Model>
[[nodiscard]] UpdateResult<Density> gauss_newton_update(
    const Density& prior, const Measurements& measurements, const Model& h,
    const GaussNewtonOptions<typename Density::Scalar>& options = {}) {
  using Z = std::remove_cvref_t<decltype(measurements[0].z)>;
  static_assert(DifferentiableModel<Model, Density, Z::RowsAtCompileTime>,
                "gauss_newton_update: the model must be callable as h(state, i, J), set the Jacobian J and "
                "return the predicted vector or a std::optional of it");
  detail::check_options(options);
  return detail::GaussNewtonIteration<Density, Measurements, Model>(prior, measurements, h, options).run();
}

/// Not an update: chosen for a prior of the wrong type, to name the mistake in the error message.
template <class Density, class... Rest>
requires(!ConcentratedDensity<Density>) void gauss_newton_update(const Density&, Rest&&...) {
  static_assert(ConcentratedDensity<Density>,
                "gauss_newton_update: the prior must be a PoseGaussian or a StateGaussian");
}

/// Not an update: chosen for measurements of the wrong type, to name the mistake in the error message.
template <ConcentratedDensity Density, class Measurements, class... Rest>
requires(!IndexedMeasurements<Measurements>) void gauss_newton_update(const Density&, const Measurements&,
                                                                      Rest&&...) {
  static_assert(IndexedMeasurements<Measurements>,
                "gauss_newton_update: the measurements must have size() and, by index, the members z and R");
}

}  // namespace antipode
