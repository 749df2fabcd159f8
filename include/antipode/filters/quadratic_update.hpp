// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <type_traits>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/solve.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/progression.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>
#include <antipode/filters/log_likelihood.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/update_status.hpp>
#include <antipode/weighted_samples.hpp>

/// Bayes update of a concentrated pose density by any likelihood, through quadratic models of the
/// log-likelihood.
///
/// Reweighting samples (progressive_update.hpp) is an explicit Euler step and needs many of them. From the
/// same samples one can fit l(y) = c + g.y - y^T H y/2 in whitened coordinates y, x = mean exp(L y), by the
/// Hermite coefficients
///
///   g = E[y l],   -H = E[(y y^T - I) l],
///
/// and condition the prior on the model raised to a power. The power grows to one as fast as the model holds,
/// measured by rho, the standard deviation of what it leaves unexplained over the density it was fitted to;
/// how informative the measurement is does not matter. Where the log-likelihood turns out to be far below
/// what the model promised, the step is taken back and repeated a part of the way. Every fit conditions the
/// original prior, so that what the first, wide fits got wrong does not add up. The last fit is to the
/// posterior itself: a fixed point, as in variational inference. A linear model with Gaussian noise takes one
/// fit and is the Kalman update.
///
/// No derivatives are needed, and the likelihood may be robust or otherwise non-Gaussian as long as the
/// posterior has one mode that the prior reaches: a cap that hides most of the measurement from most of the
/// prior leaves no slope to follow. A second mode that the samples of the fits miss stays unnoticed, and the
/// result is kConverged: where several modes are possible, start one update in each (mixture_filter.hpp).
namespace antipode {

template <std::floating_point Scalar>
struct QuadraticUpdateOptions {
  /// What may remain unexplained of the log-likelihood raised to its power, as a standard deviation.
  Scalar max_residual = Scalar(1);
  /// The posterior is settled when a fit moves it by less, in standard deviations.
  Scalar tolerance = Scalar(0.2);
  /// Most steps. Once half of them are used, the power grows evenly and overrides max_residual. Steps
  /// that have not settled by then are kDiverged.
  int max_steps = 50;
  /// A posterior with a larger residual is reported as kNotGaussian. In trials with single measurements of
  /// position and direction under wide priors (docs/results/consistency.md) no more than one NEES in 300 was
  /// above 30 below this.
  Scalar max_final_residual = Scalar(0.4);
  /// Below this log-likelihood at the posterior's samples (the best of them) the result is reported as
  /// diverged.
  Scalar min_log_likelihood = -std::numeric_limits<Scalar>::infinity();
};

namespace detail {

/// The quadratic model of a log-likelihood over a density.
template <class Scalar, int N>
struct QuadraticFit {
  QuadraticLogLikelihood<Scalar, N> model;
  Scalar mean = 0;         ///< of the log-likelihood
  Scalar residual = 0;     ///< standard deviation of what the model leaves unexplained
  Scalar explained = 0;    ///< standard deviation of the quadratic
  Scalar dropped = 0;      ///< standard deviation of what curves upwards, which the model leaves out
  LogRange<Scalar> range;  ///< the rest is set only if it is valid and supported
};

/// The log-likelihood at the points with the whitened coordinates `points`, one a column.
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

/// Asks the likelihood at the points of a rule for N(0, spread^2 I) in the density's coordinates y and
/// projects it onto Hermite polynomials.
template <class Density, class L, int N, int Count>
[[nodiscard]] auto fit_quadratic(const SqrtGaussian<Density>& density, typename Density::Scalar spread,
                                 L& log_likelihood,
                                 const WeightedSamples<typename Density::Scalar, N, Count>& standard) {
  using Scalar = typename Density::Scalar;
  using std::sqrt;
  Vector<Scalar, Count> values;
  evaluate_over<Density>({density.mean, spread * density.L, density.invertible}, log_likelihood,
                         standard.points, values);
  QuadraticFit<Scalar, N> fit;
  fit.range = bound_log_likelihoods(standard.weights, values);
  if (!fit.range.valid || !fit.range.supported()) return fit;

  const Scalar mean = standard.weights.dot(values);
  fit.mean = mean;
  Vector<Scalar, Count> errors = values.array() - mean;
  Matrix<Scalar, N> hessian = Matrix<Scalar, N>::Zero();
  Vector<Scalar, N> gradient = Vector<Scalar, N>::Zero();
  for (int k = 0; k < Count; ++k) {
    const Vector<Scalar, N> y = standard.points.col(k);
    gradient += standard.weights[k] * errors[k] * y;
    add_outer_product(standard.weights[k] * errors[k], y, y, hessian);
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

  /// How far the mean log-likelihood after the step is below what the model promised.
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

/// A share of the way from N(0, I) to y, straight in the information and the information matrix: the
/// geometric mean of the densities.
template <class Scalar, int N>
[[nodiscard]] ConditionedGaussian<Scalar, N> damped(const ConditionedGaussian<Scalar, N>& y, Scalar share) {
  const Matrix<Scalar, N> inverse_root = solve<Scalar, N, N>(y.root, Matrix<Scalar, N>::Identity());
  const Matrix<Scalar, N> inverse_root_t = inverse_root.transpose();
  const Matrix<Scalar, N> information =
      (Scalar(1) - share) * Matrix<Scalar, N>::Identity() +
      share * scaled_square<Scalar, N, N>(inverse_root_t, Vector<Scalar, N>::Ones());
  const auto C = cholesky_factor<Scalar, N>(information);
  if (!C)
    return {Vector<Scalar, N>::Constant(std::numeric_limits<Scalar>::quiet_NaN()), y.root, y.log_evidence};
  const Matrix<Scalar, N> root = solve_lower<Scalar, N, N>(*C, Matrix<Scalar, N>::Identity()).transpose();
  const Vector<Scalar, N> whitened_mean = inverse_root * y.mean;
  const Vector<Scalar, N> slope = share * (inverse_root_t * whitened_mean);
  const Vector<Scalar, N> step = root.transpose() * slope;
  return {root * step, root, y.log_evidence};
}

/// Whether y is inside N(0, I).
template <class Scalar, int N>
[[nodiscard]] bool is_within(const ConditionedGaussian<Scalar, N>& y, Scalar tolerance) {
  return y.mean.squaredNorm() <= Scalar(1) && y.root.squaredNorm() <= Scalar(N) * (Scalar(1) + tolerance);
}

/// Whether conditioning left the density where it was, in its own whitened coordinates.
template <class Scalar, int N>
[[nodiscard]] bool is_settled(const ConditionedGaussian<Scalar, N>& y, Scalar tolerance) {
  using std::abs;
  return y.mean.squaredNorm() <= tolerance * tolerance &&
         abs(y.root.squaredNorm() - Scalar(N)) <= Scalar(N) * tolerance;
}

template <class Scalar>
void check_options(const QuadraticUpdateOptions<Scalar>& options) {
  if (!(options.max_residual > Scalar(0))) [[unlikely]] {
    throw_invalid("max_residual is not positive", options.max_residual);
  }
  if (!(options.tolerance > Scalar(0))) [[unlikely]] {
    throw_invalid("tolerance is not positive", options.tolerance);
  }
  if (options.max_steps < 1) [[unlikely]] {
    throw_invalid("max_steps is not positive", options.max_steps);
  }
  if (!(options.max_final_residual > Scalar(0))) [[unlikely]] {
    throw_invalid("max_final_residual is not positive", options.max_final_residual);
  }
  if (std::isnan(options.min_log_likelihood)) [[unlikely]] {
    throw_invalid("min_log_likelihood is not a number", options.min_log_likelihood);
  }
}

enum class IterationState { kRunning, kDone, kFailed };

/// The iteration of quadratic_update: fit a model, choose the power, condition the prior, move the density.
template <class Density, class L, int Count>
class QuadraticIteration {
  using Scalar = typename Density::Scalar;
  static constexpr int N = Density::Chart::kDim;
  using Fit = QuadraticFit<Scalar, N>;

 public:
  QuadraticIteration(const Density& prior, L& log_likelihood,
                     const WeightedSamples<Scalar, N, Count>& standard,
                     const QuadraticUpdateOptions<Scalar>& options)
      : origin_(SqrtGaussian<Density>::of(prior)),
        log_likelihood_(log_likelihood),
        standard_(standard),
        options_(options),
        density_(origin_),
        last_{origin_},
        result_{.posterior = prior} {}

  [[nodiscard]] UpdateResult<Density> run() {
    IterationState state = IterationState::kRunning;
    while (state == IterationState::kRunning) state = iterate();
    if (state == IterationState::kFailed) return result_;
    result_.posterior = density_.density();
    judge();
    return result_;
  }

 private:
  static constexpr Scalar kMinSpread{1.0 / 64.0};  // of the fit, in standard deviations
  static constexpr int kMostRepeats = 2;           // of fits without growth, before steps are halved
  static constexpr int kMostRetries = 12;          // of one step, each half as far

  /// The status of a posterior, by the residual over it. The last fit was to a density a little larger and is
  /// enough if that leaves little unexplained; if it was narrower, nothing but a fit to the posterior is.
  void judge() {
    if (!fit_of_posterior_ || result_.residual > options_.max_final_residual) {
      const Fit fit = fit_quadratic(density_, Scalar(1), log_likelihood_, standard_);
      result_.evaluations += Count;
      const bool usable = fit.range.valid && fit.range.supported() && std::isfinite(fit.residual);
      result_.residual =
          usable ? std::hypot(fit.residual, fit.dropped) : std::numeric_limits<Scalar>::infinity();
    }
    if (result_.status != UpdateStatus::kConverged) return;
    if (result_.log_likelihood < options_.min_log_likelihood) {
      result_.status = UpdateStatus::kDiverged;
    } else if (result_.residual > options_.max_final_residual) {
      result_.status = UpdateStatus::kNotGaussian;
    }
  }

  [[nodiscard]] IterationState iterate() {
    auto fit = fit_quadratic(density_, spread_, log_likelihood_, standard_);
    result_.evaluations += Count;
    if (!fit.range.valid || !std::isfinite(fit.residual)) return fail(UpdateStatus::kNotFinite);
    if (overshot(fit)) {
      fit = take_back_last_step();
    } else {
      if (needs_narrower_fit(fit)) return refit_narrower();
      if (!fit.range.supported()) return fail(UpdateStatus::kNoSupport);
      choose_power(fit);
    }
    result_.log_likelihood = fit.range.hi;
    result_.residual = std::hypot(fit.residual, fit.dropped);
    condition_on(fit);
    if (!last_.y.finite()) return fail(UpdateStatus::kNotFinite);
    const bool settled = has_settled(fit);
    if (!settled) halve_step();
    return move(settled);
  }

  /// Whether the log-likelihood fell short of what the model of the last step promised.
  [[nodiscard]] bool overshot(const Fit& fit) const {
    constexpr Scalar kMaxShortfall = Scalar(6);  // in max_residual
    return retries_ < kMostRetries && origin_.invertible &&
           power_ * last_.shortfall(fit, spread_) > kMaxShortfall * options_.max_residual;
  }

  /// Returns to where the last step started; the next one goes half as far.
  [[nodiscard]] Fit take_back_last_step() {
    ++retries_;
    density_ = last_.density;
    next_ = last_.next;
    power_ = last_.power;
    return last_.fit;
  }

  [[nodiscard]] bool needs_narrower_fit(const Fit& fit) const {
    constexpr Scalar kPoorFit = Scalar(0.7);  // of what it should explain remains unexplained
    const bool poor = !fit.range.supported() || fit.residual > kPoorFit * fit.explained;
    return poor && fit.residual > options_.max_residual && spread_ > kMinSpread;
  }

  [[nodiscard]] IterationState refit_narrower() {
    spread_ /= 2;
    return IterationState::kRunning;
  }

  /// The power grows as fast as the residual of the fit allows, and by a quarter where it stalls.
  void choose_power(const Fit& fit) {
    constexpr Scalar kGrowth = Scalar(1.05);        // below which the power stalls
    constexpr Scalar kForcedGrowth = Scalar(1.25);  // when it does
    const auto wanted =
        next_power(power_, options_.max_residual / fit.residual, result_.steps, options_.max_steps);
    result_.limit_hit = result_.limit_hit || wanted.forced;
    next_ = wanted.power;
    repeats_ = next_ > kGrowth * power_ ? 0 : repeats_ + 1;
    // The posterior is less Gaussian than max_residual asks for; the power has to grow all the same.
    if (repeats_ > kMostRepeats) next_ = std::min(Scalar(1), std::max(next_, kForcedGrowth * power_));
    last_.fit = fit;
    last_.density = density_;
    last_.power = power_;
    last_.next = next_;
    retries_ = 0;
  }

  void condition_on(const Fit& fit) {
    last_.y = origin_.invertible
                  ? density_.condition_prior(origin_, fit.model.scaled(next_))
                  : condition<Scalar, N>(Vector<Scalar, N>::Zero(), Matrix<Scalar, N>::Identity(),
                                         fit.model.scaled(next_ - power_));
  }

  /// Whether the density after this step is the posterior. A model that is exact over the prior is exact over
  /// the posterior; so is one that is exact over a density that the posterior lies within.
  [[nodiscard]] bool has_settled(const Fit& fit) const {
    constexpr Scalar kExactFit = Scalar(0.01);  // residual at which a fit needs no repetition
    const bool exact = spread_ == Scalar(1) && fit.residual <= kExactFit &&
                       (result_.steps == 0 || is_within(last_.y, options_.tolerance));
    return next_ == Scalar(1) && retries_ == 0 &&
           (exact || is_settled(last_.y, options_.tolerance) || !origin_.invertible);
  }

  /// Half steps end the oscillation that whole ones may fall into.
  void halve_step() {
    const int halvings = retries_ > 0 ? retries_ : repeats_ > kMostRepeats ? 1 : 0;
    if (halvings == 0 || !origin_.invertible) return;
    const Scalar share = std::pow(Scalar(0.5), Scalar(halvings));
    last_.y = damped(last_.y, share);
    if (retries_ > 0) next_ = power_ + share * (next_ - power_);
  }

  [[nodiscard]] IterationState move(bool settled) {
    const auto moved = density_.moved(last_.y);
    if (!moved) {  // a model that leads nowhere is a poor one
      return spread_ > kMinSpread ? refit_narrower() : fail(UpdateStatus::kDiverged);
    }
    density_ = *moved;
    power_ = next_;
    ++result_.steps;
    result_.log_evidence =
        origin_.invertible ? last_.y.log_evidence : result_.log_evidence + last_.y.log_evidence;
    if (settled) {
      fit_of_posterior_ = origin_.invertible && spread_ == Scalar(1);
      return IterationState::kDone;
    }
    if (result_.steps >= options_.max_steps) {
      result_.status = UpdateStatus::kDiverged;
      result_.limit_hit = true;
      return IterationState::kDone;
    }
    spread_ = std::min(Scalar(1), 2 * spread_);
    return IterationState::kRunning;
  }

  /// The posterior stays the prior.
  [[nodiscard]] IterationState fail(UpdateStatus status) {
    result_.status = status;
    return IterationState::kFailed;
  }

  const SqrtGaussian<Density> origin_;  ///< the prior
  L& log_likelihood_;
  const WeightedSamples<Scalar, N, Count>& standard_;
  const QuadraticUpdateOptions<Scalar>& options_;

  SqrtGaussian<Density> density_;  ///< the prior conditioned on the likelihood to the power
  Scalar power_ = Scalar(0);
  Scalar next_ = Scalar(0);    ///< power after the step
  Scalar spread_ = Scalar(1);  ///< of the points that the model is fitted to, in standard deviations
  QuadraticStep<Density> last_;
  int retries_ = kMostRetries;  ///< of the last step
  bool fit_of_posterior_ = false;
  int repeats_ = 0;  ///< fits in succession that did not allow a larger power
  UpdateResult<Density> result_;
};

}  // namespace detail

/// The posterior of `prior` and a measurement with the given log-likelihood, either Scalar(pose) or
/// void(8 x Count poses, values) (see log_likelihood.hpp). The rule must be exact to degree 5. Throws on
/// invalid options and covariances; numerical failures are reported in the status. With a singular covariance
/// the powers are applied one after another and there is no fixed point.
template <ConcentratedDensity Density, class L, GaussianRule Rule = MysovskikhRule<Density::Chart::kDim>>
requires(Rule::kDim == Density::Chart::kDim && LogLikelihoodOver<L, Density, Rule::kCount>)
    [[nodiscard]] UpdateResult<Density> quadratic_update(
        const Density& prior, L&& log_likelihood,
        const QuadraticUpdateOptions<typename Density::Scalar>& options = {}, const Rule& rule = {}) {
  detail::check_options(options);
  const auto standard = rule.template standard<typename Density::Scalar>();
  return detail::QuadraticIteration<Density, std::remove_reference_t<L>, Rule::kCount>(prior, log_likelihood,
                                                                                       standard, options)
      .run();
}

}  // namespace antipode
