// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <type_traits>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/check.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/mode_search.hpp>
#include <antipode/filters/detail/model_misfit.hpp>
#include <antipode/filters/detail/progression.hpp>
#include <antipode/filters/detail/quadratic_fit.hpp>
#include <antipode/filters/detail/quadratic_step.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>
#include <antipode/filters/log_likelihood.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/update_status.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Bayes update of a concentrated pose density by any likelihood, through quadratic models of the
/// log-likelihood.
///
/// Reweighting samples (progressive_update.hpp) is an explicit Euler integration and needs many steps. From
/// the same samples one can fit l(y) = c + g.y - y^T H y/2 in whitened coordinates y, x = mean exp(L y), by
/// the Hermite coefficients
///
///     g = E[y l],   -H = E[(y y^T - I) l],
///
/// and condition the prior on the model raised to a power. The power grows to one as fast as the model holds.
/// The measure is rho, the standard deviation of what the model leaves unexplained over the density it was
/// fitted to; how informative the measurement is does not matter. If the log-likelihood after a step is far
/// below what the model predicted, the step is taken back and repeated with a part of its length. Every fit
/// conditions the original prior, so that the errors of the first, wide fits do not add up. The last fit is
/// to the posterior itself: a fixed point, as in variational inference. A model that is exact over the prior
/// needs no second fit: a linear model with Gaussian noise takes one, which is the Kalman update.
///
/// The points of a fit are the centre and others at one distance from it, where every function of the
/// distance looks quadratic. Therefore the last model is checked over the posterior at two other distances
/// (17 poses). If a model that was exact over the prior is not confirmed, the fits go on; what the check of
/// the last model finds counts as residual.
///
/// No derivatives are needed. The likelihood may be robust or otherwise non-Gaussian as long as the posterior
/// has one mode that the prior reaches: a capped likelihood that is constant over most of the prior leaves no
/// slope to follow. If the log-likelihood is not quadratic over the prior, the update searches for a second
/// mode: on straight lines in the directions in which the measurement narrowed the prior, and by ascents from
/// places on these lines where the density falls less than it should. Such a mode, the mirrored tilt of a
/// planar pattern say, is reported as kNotGaussian. docs/results/consistency.md shows how often one is
/// missed. If several modes are possible, start one update in each (mixture_filter.hpp).
namespace antipode {

/// How large the steps are, when they end, and which results are reported as not to be trusted.
template <std::floating_point Scalar>
struct QuadraticUpdateOptions {
  /// Largest residual of the log-likelihood raised to its power: the standard deviation of what the model
  /// leaves unexplained.
  Scalar max_residual = Scalar(1);
  /// The posterior is settled when a fit moves it by less, in standard deviations.
  Scalar tolerance = Scalar(0.2);
  /// Most steps. Once half of them are used, the power grows evenly and overrides max_residual. Steps
  /// that have not settled by then are kDiverged.
  int max_steps = 50;
  /// A posterior with a larger residual is reported as kNotGaussian. In trials with single measurements of
  /// position and direction under wide priors (docs/results/consistency.md), at most one in 300 posteriors
  /// with a smaller residual had a NEES above 30.
  Scalar max_final_residual = Scalar(0.4);
  /// Whether to look for a second mode if the log-likelihood is not quadratic over the prior, or over a
  /// density on the way to the posterior. Costs two more fits, and up to a few dozen if a second mode is
  /// likely.
  bool check_modes = true;
  /// Below this log-likelihood at the posterior's samples (the best of them) the result is reported as
  /// diverged.
  Scalar min_log_likelihood = -std::numeric_limits<Scalar>::infinity();
};

namespace detail {

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
    IterationState state =
        origin_.has_finite_samples() ? IterationState::kRunning : fail(UpdateStatus::kNotFinite);
    while (state == IterationState::kRunning) state = iterate();
    if (state == IterationState::kFailed) return result_;
    if (rounding_hides_differences()) {
      (void)fail(UpdateStatus::kNotFinite);
      return result_;
    }
    result_.posterior = density_.density();
    judge();
    return result_;
  }

 private:
  static constexpr Scalar kMinSpread{1.0 / 64.0};  // of the fit, in standard deviations
  static constexpr int kMostRepeats = 2;           // of fits without growth, before steps are halved
  static constexpr int kMostRetries = 12;          // of one step, each half as far

  /// Sets the status of a posterior by the residual over it. The last fit was to a slightly wider density,
  /// and suffices if its residual is small. Otherwise, or if that fit was narrower, the posterior needs a fit
  /// of its own.
  void judge() {
    if (!fit_of_posterior_ || !(result_.residual <= options_.max_final_residual)) {
      const Fit fit = fit_quadratic(density_, Scalar(1), log_likelihood_, standard_);
      result_.evaluations += Count;
      const bool usable = fit.range.valid && fit.range.supported() && std::isfinite(fit.residual) &&
                          std::isfinite(fit.dropped);
      const ConditionedGaussian<Scalar, N> itself{Vector<Scalar, N>::Zero(), Matrix<Scalar, N>::Identity(), 0,
                                                  0};
      result_.residual = usable ? std::max({std::hypot(fit.residual, fit.dropped), left_by_last_model_,
                                            check(density_, itself, fit).radial})
                                : std::numeric_limits<Scalar>::infinity();
    }
    if (result_.status != UpdateStatus::kConverged) return;
    if (result_.log_likelihood < options_.min_log_likelihood) {
      result_.status = UpdateStatus::kDiverged;
    } else if (result_.residual > options_.max_final_residual || is_ambiguous()) {
      result_.status = UpdateStatus::kNotGaussian;
    }
  }

  /// Whether the log-likelihood over the posterior is so large that its differences are lost to rounding, as
  /// those of an outlier of 1e18 standard deviations: then it looks constant, and every density settled.
  [[nodiscard]] bool rounding_hides_differences() const {
    constexpr Scalar kLost = Scalar(0.4);  // of a log-likelihood
    return std::abs(result_.log_likelihood) * std::numeric_limits<Scalar>::epsilon() > kLost;
  }

  /// What the model of a fit to `density` leaves unexplained over y, at other radii than that of the fit.
  [[nodiscard]] Misfit<Scalar> check(const SqrtGaussian<Density>& density,
                                     const ConditionedGaussian<Scalar, N>& y, const Fit& fit) {
    result_.evaluations += CheckPoints<N>::kCount;
    auto left = misfit<Count>(density, y, fit.model, log_likelihood_);
    left.radial *= std::sqrt(Scalar(N) / measured_axes(density.whitened_root * y.root));
    return left;
  }

  /// The number of axes that the measurement narrowed, from 1 to N, for a root of the posterior's covariance
  /// in the whitened coordinates of the prior. A misfit of the radius changes the variances of these only.
  [[nodiscard]] static Scalar measured_axes(const Matrix<Scalar, N>& root) {
    return std::clamp(Scalar(N) - root.squaredNorm(), Scalar(1), Scalar(N));
  }

  [[nodiscard]] bool is_ambiguous() {
    if (!options_.check_modes || !bent_) return false;
    const auto evaluate = [&](const Matrix<Scalar, N, Count>& tangents, Vector<Scalar, Count>& values) {
      result_.evaluations += Count;
      evaluate_over<Density>({density_.mean, Matrix<Scalar, N>::Identity()}, log_likelihood_, tangents,
                             values);
    };
    const auto local_model = [&](const SqrtGaussian<Density>& density) {
      using Local = LocalModel<Scalar, N>;
      result_.evaluations += Count;
      const Fit fit = fit_quadratic(density, Scalar(1), log_likelihood_, standard_);
      const bool usable = fit.range.valid && fit.range.supported() && std::isfinite(fit.residual);
      return usable ? std::optional<Local>({fit.model, fit.model.constant}) : std::nullopt;
    };
    return has_second_mode<Count>(origin_, density_, {result_.log_evidence}, evaluate, local_model);
  }

  [[nodiscard]] IterationState iterate() {
    auto fit = fit_quadratic(density_, spread_, log_likelihood_, standard_);
    result_.evaluations += Count;
    bent_ = bent_ || is_bent(fit);
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
    if (!last_.y.finite() || !std::isfinite(last_.y.log_evidence)) return fail(UpdateStatus::kNotFinite);
    const bool settled = settles(fit);
    if (!settled) halve_step();
    return move(settled);
  }

  /// Whether the log-likelihood is not quadratic over the density.
  [[nodiscard]] bool is_bent(const Fit& fit) const {
    constexpr Scalar kBent = Scalar(0.005);  // residual as a share of the explained
    return !fit.range.supported() ||
           !(fit.residual <= std::max(options_.max_final_residual, kBent * fit.explained));
  }

  /// Whether the log-likelihood fell short of what the model of the last step promised.
  [[nodiscard]] bool overshot(const Fit& fit) const {
    constexpr Scalar kMaxShortfall = Scalar(6);  // in max_residual
    return retries_ < kMostRetries &&
           power_ * last_.shortfall(fit, spread_) > kMaxShortfall * options_.max_residual;
  }

  /// Returns to the start of the last step; the next one goes half as far.
  [[nodiscard]] Fit take_back_last_step() {
    ++retries_;
    density_ = last_.density;
    next_ = last_.next;
    power_ = last_.power;
    return last_.fit;
  }

  [[nodiscard]] bool needs_narrower_fit(const Fit& fit) const {
    constexpr Scalar kPoorFit = Scalar(0.7);  // residual as a share of the explained
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

  void condition_on(const Fit& fit) { last_.y = density_.condition_prior(fit.model.scaled(next_)); }

  /// Whether the density after this step is the posterior. A model that is exact over the prior, or over a
  /// density that the posterior lies within, is exact over the posterior if it holds at other radii as well.
  [[nodiscard]] bool settles(const Fit& fit) {
    constexpr Scalar kExactFit = Scalar(0.01);  // residual at which a fit needs no repetition
    if (next_ != Scalar(1) || retries_ > 0) return false;
    const bool fixed = is_settled(last_.y, options_.tolerance);
    const bool exact = spread_ == Scalar(1) && fit.residual <= kExactFit &&
                       (result_.steps == 0 || is_within(last_.y, options_.tolerance));
    if (!fixed && !exact) return false;
    const Misfit<Scalar> left = check(last_.density, last_.y, fit);
    if (!fixed && left.total > options_.tolerance) {
      bent_ = true;
      return false;
    }
    if (spread_ == Scalar(1)) {
      result_.residual = std::max(result_.residual, left.radial);
    } else {
      left_by_last_model_ = left.total;
    }
    return true;
  }

  /// Halves the step where whole steps may oscillate or went too far.
  void halve_step() {
    const int halvings = retries_ > 0 ? retries_ : repeats_ > kMostRepeats ? 1 : 0;
    if (halvings == 0) return;
    const Scalar share = std::pow(Scalar(0.5), Scalar(halvings));
    last_.y = damped(last_.y, share);
    if (retries_ > 0) next_ = power_ + share * (next_ - power_);
  }

  [[nodiscard]] IterationState move(bool settled) {
    const auto moved = density_.moved(origin_, last_.y);
    if (!moved) {  // a model that leads out of the chart is a poor one
      return spread_ > kMinSpread ? refit_narrower() : fail(UpdateStatus::kDiverged);
    }
    density_ = *moved;
    power_ = next_;
    ++result_.steps;
    result_.log_evidence = last_.y.log_evidence;
    result_.nis = last_.y.nis;
    if (settled) {
      fit_of_posterior_ = spread_ == Scalar(1);
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
  bool bent_ = false;  ///< the log-likelihood is not quadratic over the prior, or a density on the way
  Scalar left_by_last_model_ = Scalar(0);  ///< over the posterior, if a fit of its own has another model
  int repeats_ = 0;                        ///< fits in succession that did not allow a larger power
  UpdateResult<Density> result_;
};

}  // namespace detail

/// The posterior of `prior` and a measurement with the given log-likelihood, either Scalar(pose) or
/// void(8 x Count poses, values) (see log_likelihood.hpp). The rule must be exact to degree 5; by default it
/// is MysovskikhRule up to six dimensions (57 points for a pose) and Degree5Rule up to eighteen (146 points
/// for nine, 542 for fifteen). Throws on invalid options and covariances; numerical failures are reported in
/// the status. The covariance of the prior may be singular: what it knows exactly, the posterior knows
/// exactly.
template <ConcentratedDensity Density, class L, class Rule = detail::RuleOfDegree5<Density::Chart::kDim>>
[[nodiscard]] UpdateResult<Density> quadratic_update(
    const Density& prior, L&& log_likelihood,
    const QuadraticUpdateOptions<typename Density::Scalar>& options = {}, const Rule& rule = {}) {
  static_assert(
      !std::same_as<Rule, detail::NoRule>,
      "quadratic_update: for states of more than 18 dimensions pass a GaussianRule that is exact to "
      "degree 5; or use linearized_update or gauss_newton_update, with GaussianMeasurements");
  static_assert(detail::GaussianRuleIn<Rule, Density::Chart::kDim>,
                "quadratic_update: the rule must be a GaussianRule of the dimension of the state");
  static_assert(
      LogLikelihoodOver<L, Density, Rule::kCount>,
      "quadratic_update: the log-likelihood must be callable as Scalar(state), for poses also as "
      "void(poses, values); of GaussianMeasurements and RobustMeasurements the model as h(state, i)");
  detail::check_options(options);
  const auto standard = rule.template standard<typename Density::Scalar>();
  return detail::QuadraticIteration<Density, std::remove_reference_t<L>, Rule::kCount>(prior, log_likelihood,
                                                                                       standard, options)
      .run();
}

/// Not an update: chosen for a prior of the wrong type, to name the mistake in the error message.
template <class Density, class... Rest>
requires(!ConcentratedDensity<Density>) void quadratic_update(const Density&, Rest&&...) {
  static_assert(ConcentratedDensity<Density>,
                "quadratic_update: the prior must be a PoseGaussian or a StateGaussian");
}

}  // namespace antipode
