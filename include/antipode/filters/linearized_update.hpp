// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
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
#include <antipode/filters/detail/measurement_iteration.hpp>
#include <antipode/filters/detail/measurement_modes.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>
#include <antipode/filters/detail/statistical_regression.hpp>
#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/noisy_measurement.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/update_status.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Bayes update of a concentrated pose density by measurements z_i = h_i(x) + v_i, v_i ~ N(0, R_i), through
/// linear models of h (iterated posterior linearisation).
///
/// Each iteration regresses every h_i on the points of a sigma point rule over the current density, h_i ~
/// mean_i + A_i y + e_i with Cov(e_i) = Omega_i, and conditions the original prior on these linear models
/// with the noise R_i + Omega_i. No derivatives are needed. It is for a few
/// measurements with Gaussian noise and known h and R. For any other likelihood, for data with outliers and
/// for many measurements, use quadratic_update. Reference: Garcia-Fernandez, Svensson, Morelande, Sarkka,
/// "Posterior linearization filter: principles and implementation using sigma points", 2015.
namespace antipode {

/// Measurements by index: a vector, array or span of NoisyMeasurement.
template <class Measurements>
concept IndexedMeasurements = requires(const Measurements& measurements, std::size_t i) {
  { measurements.size() } -> std::convertible_to<std::size_t>;
  measurements[i].z;
  measurements[i].R;
};

/// h(state, i) predicts the i-th measurement, as a vector or a std::optional of one.
template <class Model, class Density, class Z>
concept MeasurementModelOver = requires(const Model& h, const typename Density::Chart::Point& state,
                                        std::size_t i) {
  { h(state, i) } -> std::convertible_to<std::optional<Z>>;
};

/// How much a measurement of squared Mahalanobis distance d^2 counts.
///
/// Weights protect the estimate from a few outliers among many measurements, but the covariance is NOT right
/// with them, and no status reports this. Huber's is overconfident wherever there are outliers (ANEES 28 to
/// 1e6 instead of 6), Cauchy's with fewer than a hundred measurements under a wide prior (up to 6e4). For
/// outliers use RobustMeasurements (robust_likelihood.hpp) with quadratic_update. Its covariance is right
/// with ten measurements or more; docs/results/consistency.md compares them. With a single one under a prior
/// a few times as wide as its noise, the posterior has heavy tails itself: see robust_likelihood.hpp.
enum class RobustWeight {
  kNone,    ///< 1
  kHuber,   ///< scale/d beyond the scale: limits the influence of an outlier, does not remove it
  kCauchy,  ///< 1/(1 + d^2/scale^2)
};

/// When the iteration ends, which results are reported as not to be trusted, and how outliers are weighted.
template <std::floating_point Scalar>
struct LinearizedUpdateOptions {
  /// Most regressions. If the last one still moves the mean by more than settled_step, the result is
  /// reported as diverged.
  int max_iterations = 20;
  /// An iteration that moves the mean by less, in standard deviations of the density, is the last.
  Scalar tolerance = Scalar(0.01);
  /// The largest last step, in the same unit, of a result that is not reported as diverged.
  Scalar settled_step = Scalar(0.2);
  /// A posterior with a larger residual, the root of the sum of tr(R^-1 Omega_i), is reported as
  /// kNotGaussian. Its covariance contains the Omega_i and is as large as the error on average, but large
  /// errors are more frequent than for a Gaussian. The unit is the noise of one measured number. Measured in
  /// docs/results/consistency.md.
  Scalar max_final_residual = Scalar(1);
  /// Whether to look for a second mode if the measurements are not linear over the prior, or over a density
  /// on the way to the posterior, and to report it as kNotGaussian (see quadratic_update.hpp). Evaluates each
  /// model 16 times for every dimension of the state, and more if a second mode is likely. Not with robust
  /// weights.
  bool check_modes = true;
  RobustWeight robust = RobustWeight::kNone;  ///< how much distant measurements count
  /// Mahalanobis distance at which a measurement begins to count less. It refers to the covariance S_i of the
  /// innovation, which includes the spread of the current density: under a wide prior all measurements keep
  /// their weight.
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

/// Linear models of the measurements over a density: their joint log-likelihood in the density's coordinates
/// y.
template <class Scalar, int N>
struct Linearization {
  QuadraticLogLikelihood<Scalar, N> model;
  Scalar log_normalizer = 0;  ///< part of the model's constant, as its noise is R_i + Omega_i, not R_i
  Scalar residual = 0;        ///< sum of tr(R_i^-1 Omega_i)
  Scalar explained = 0;       ///< sum of tr(R_i^-1 A_i A_i^T)
  int used = 0;               ///< measurements that can be made at every sample
  bool finite = true;

  /// Whether the measurements are not linear over the density.
  [[nodiscard]] bool bent() const {
    constexpr Scalar kBent = Scalar(0.001);  // share of the explained variance that remains unexplained
    return residual > std::max(Scalar(1), kBent * explained);
  }
};

/// Adds the log-likelihood of one measurement. Sets `finite` to false if it cannot be computed.
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
  sum.model.curvature +=
      scaled_square<Scalar, N, Dim>(slope, Vector<Scalar, Dim>::Constant(z.size(), weight));
  sum.model.constant -= Scalar(0.5) * weight * whitened.squaredNorm();
  Scalar log_normalizer(0);
  for (int j = 0; j < static_cast<int>(z.size()); ++j)
    log_normalizer -= log((*noise_root)(j, j) / (*R_root)(j, j));
  sum.log_normalizer += log_normalizer;
  sum.model.constant += log_normalizer;
  const Square R_inverse_root = solve_lower<Scalar, Dim, Dim>(*R_root, Square::Identity(z.size(), z.size()));
  sum.explained += Matrix<Scalar, Dim, N>(R_inverse_root * h.A).squaredNorm();
  sum.residual += congruence<Scalar, Dim, Dim>(R_inverse_root, h.disturbance).trace();
}

/// The Linearization of all measurements that can be predicted at every sigma point of the density.
template <class Density, class Measurements, class Model, int N, int Count>
[[nodiscard]] auto linearize(const SqrtGaussian<Density>& density, const Measurements& measurements,
                             const Model& h,
                             const WeightedSamples<typename Density::Scalar, N, Count>& standard,
                             const LinearizedUpdateOptions<typename Density::Scalar>& options) {
  using Scalar = typename Density::Scalar;
  using Z = std::remove_cvref_t<decltype(measurements[0].z)>;
  constexpr int kDim = Z::RowsAtCompileTime;
  Linearization<Scalar, N> sum;
  if (!std::isfinite(density.L.squaredNorm() * standard.points.squaredNorm())) {
    sum.finite = false;  // the points overflow
    return sum;
  }
  std::array<typename Density::Chart::Point, static_cast<std::size_t>(Count)> states;
  for (std::size_t k = 0; k < Count; ++k) states[k] = density.at(standard.points.col(static_cast<int>(k)));
  Matrix<Scalar, kDim, Count> predicted;
  const std::size_t count = measurements.size();
  for (std::size_t i = 0; i < count && sum.finite; ++i) {
    bool measurable = true;
    predicted.resize(measurements[i].z.rows(), Count);
    for (std::size_t k = 0; k < Count && measurable; ++k) {
      const auto z = checked_prediction<Z>(measurements[i].z, h(states[k], i));
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

/// The iteration of linearized_update: regress h on the points over the density, condition the prior, move.
template <class Density, class Measurements, class Model, class Rule>
class LinearizedIteration : MeasurementIteration<Density, Measurements, Model> {
  using Base = MeasurementIteration<Density, Measurements, Model>;
  using Base::N, Base::origin_, Base::density_, Base::measurements_, Base::h_, Base::result_, Base::fail;
  using typename Base::Scalar;

 public:
  LinearizedIteration(const Density& prior, const Measurements& measurements, const Model& h,
                      const LinearizedUpdateOptions<Scalar>& options)
      : Base(prior, measurements, h), options_(options) {}

  [[nodiscard]] UpdateResult<Density> run(const Rule& rule) {
    if (!this->begins()) return result_;
    const auto standard = rule.template standard<Scalar>();
    do {
      if (!iterate(standard)) return result_;
    } while (result_.limit_hit && result_.steps < options_.max_iterations);
    judge(standard);
    result_.posterior = density_.density();
    return result_;
  }

 private:
  /// Whether the density was conditioned and moved. If not, the status says why.
  template <class Standard>
  [[nodiscard]] bool iterate(const Standard& standard) {
    const auto fit = linearize(density_, measurements_, h_, standard, options_);
    result_.evaluations += Rule::kCount;
    if (!fit.finite) return fail(UpdateStatus::kNotFinite);
    if (fit.used == 0) return fail(UpdateStatus::kNoSupport);
    const auto y = density_.condition_prior(fit.model);
    if (!y.finite() || !std::isfinite(y.log_evidence)) return fail(UpdateStatus::kNotFinite);
    const auto moved = density_.moved(origin_, y);
    if (!moved) return fail(UpdateStatus::kDiverged);
    density_ = *moved;
    bent_ = bent_ || fit.bent();
    ++result_.steps;
    result_.log_evidence = y.log_evidence;
    result_.log_likelihood = fit.model.constant;
    result_.nis = y.nis + Scalar(2) * fit.log_normalizer;
    result_.residual = std::sqrt(fit.residual);
    // A step is measured in standard deviations of the density that it started from. These are of the
    // posterior's size after the first step.
    last_step_ = result_.steps > 1 ? y.mean.norm() : std::numeric_limits<Scalar>::infinity();
    result_.limit_hit = !(last_step_ <= options_.tolerance);
    return true;
  }

  template <class Standard>
  void judge(const Standard& standard) {
    const bool check_modes = options_.check_modes && bent_ && options_.robust == RobustWeight::kNone;
    if (result_.limit_hit && !(last_step_ <= options_.settled_step)) {
      result_.status = UpdateStatus::kDiverged;
    } else if (!(result_.residual <= options_.max_final_residual) ||
               (check_modes && is_ambiguous(standard))) {
      result_.status = UpdateStatus::kNotGaussian;
    }
  }

  template <class Standard>
  [[nodiscard]] bool is_ambiguous(const Standard& standard) {
    MeasurementLikelihood<Density, Measurements, Model> likelihood{measurements_, h_, result_.evaluations};
    const auto local_model = [&](const SqrtGaussian<Density>& density) {
      using Local = LocalModel<Scalar, N>;
      result_.evaluations += Rule::kCount;
      const auto fit = linearize(density, measurements_, h_, standard, options_);
      return fit.finite && fit.used > 0 ? std::optional<Local>({fit.model, likelihood.at(density.mean)})
                                        : std::nullopt;
    };
    return likelihood.has_second_mode(origin_, density_, result_.log_evidence, local_model);
  }

  const LinearizedUpdateOptions<Scalar>& options_;
  Scalar last_step_ = std::numeric_limits<Scalar>::infinity();
  bool bent_ = false;  ///< the measurements are not linear over the prior, or a density on the way
};

template <class Scalar>
void check_options(const LinearizedUpdateOptions<Scalar>& options) {
  check_iteration_options(options);
  if (!(options.settled_step > Scalar(0))) [[unlikely]] {
    throw_invalid("settled_step is not positive", options.settled_step);
  }
  if (!(options.robust_scale > Scalar(0))) [[unlikely]] {
    throw_invalid("robust_scale is not positive", options.robust_scale);
  }
}

}  // namespace detail

/// The posterior of `prior` and independent measurements, a std::vector of NoisyMeasurement, say.
///
/// h(pose, i) predicts the i-th measurement, as a vector or a std::optional of one. A measurement that cannot
/// be predicted at some sigma point, a landmark behind the camera say, is left out of that iteration. The
/// covariance of the prior may be singular: what it knows exactly, the posterior knows exactly. With
/// NoisyMeasurement<Scalar, Eigen::Dynamic> the measurements may have different lengths.
///
/// Throws on invalid options, on an invalid covariance of the prior, if R is not symmetric (a triangle of it
/// is not enough), and if R or the prediction differs in length from z. The status is kNotFinite if a
/// measurement is not finite or its R not positive definite, and kNoSupport if no measurement can be
/// predicted; the posterior then is the prior.
///
/// The default rule is exact to degree 5 for states of up to 18 dimensions: MysovskikhRule up to six (57
/// points for a pose), Degree5Rule above (146 points for nine dimensions, 542 for fifteen). CubatureRule has
/// 2 N points, all on the axes, and is enough if the attitude is known to .05 rad. It does not see products
/// of two coordinates, such as roll times pitch in a measured heading, and no status says so: a heading known
/// to .005 rad under priors of .2 rad has an ANEES of 14 instead of 6, and 16 instead of 9 with a velocity in
/// the state; at .1 rad it is 10 of 9. Larger states have these points.
template <ConcentratedDensity Density, IndexedMeasurements Measurements, class Model,
          class Rule = detail::DefaultRule<Density::Chart::kDim>>
[[nodiscard]] UpdateResult<Density> linearized_update(
    const Density& prior, const Measurements& measurements, const Model& h,
    const LinearizedUpdateOptions<typename Density::Scalar>& options = {}, const Rule& rule = {}) {
  static_assert(
      MeasurementModelOver<Model, Density, std::remove_cvref_t<decltype(measurements[0].z)>>,
      "linearized_update: the model must be callable as h(state, i) and return the predicted vector "
      "or a std::optional of it");
  static_assert(detail::GaussianRuleIn<Rule, Density::Chart::kDim>,
                "linearized_update: the rule must be a GaussianRule of the dimension of the state");
  detail::check_options(options);
  return detail::LinearizedIteration<Density, Measurements, Model, Rule>(prior, measurements, h, options)
      .run(rule);
}

/// Not an update: chosen for a prior of the wrong type, to name the mistake in the error message.
template <class Density, class... Rest>
requires(!ConcentratedDensity<Density>) void linearized_update(const Density&, Rest&&...) {
  static_assert(ConcentratedDensity<Density>,
                "linearized_update: the prior must be a PoseGaussian or a StateGaussian");
}

/// Not an update: chosen for measurements of the wrong type, to name the mistake in the error message.
template <ConcentratedDensity Density, class Measurements, class... Rest>
requires(!IndexedMeasurements<Measurements>) void linearized_update(const Density&, const Measurements&,
                                                                    Rest&&...) {
  static_assert(IndexedMeasurements<Measurements>,
                "linearized_update: the measurements must have size() and, by index, the members z and R");
}

}  // namespace antipode
