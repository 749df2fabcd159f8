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
#include <antipode/detail/cholesky.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_charts.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/mode_ascent.hpp>
#include <antipode/filters/detail/mode_search.hpp>
#include <antipode/filters/detail/moment_floor.hpp>
#include <antipode/filters/detail/posterior_samples.hpp>
#include <antipode/filters/detail/progression.hpp>
#include <antipode/filters/detail/quadratic_fit.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>
#include <antipode/filters/log_likelihood.hpp>
#include <antipode/filters/update_status.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/sampling/pose_rules.hpp>
#include <antipode/sampling/sigma_point_rule.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Progressive Bayes update of a pose density by any likelihood (DQV-SLAM Alg. 2, corrected, in the log
/// domain).
///
/// The likelihood is applied in powers that add up to one. Each step samples the current density, reweights
/// the samples and matches a density to them. It is as long as possible without any two weights changing by
/// more than 1 : tau relative to each other. With shrinking steps this follows the moments of the true
/// posterior, provided that the rule has the right FOURTH moments and the density its coupling: RichPoseRule
/// or JointPoseRule, keep_coupling. The paper's setting (PaperPoseRule, no coupling) is there for comparison;
/// it is overconfident. The density has one mode. A likelihood with several leaves a large residual, which is
/// reported; use a bank of filters then (mixture_filter.hpp). Corrections to the paper: docs/papers.md.
namespace antipode {

/// How long the steps are, and which results are reported as not to be trusted.
template <std::floating_point Scalar>
struct ProgressiveOptions {
  /// Smallest ratio of two samples' likelihoods within a step, inside (0, 1). Values nearer to one take more
  /// steps and are more accurate; 0.8 for weak priors.
  Scalar tau = Scalar(0.5);
  /// Most steps; overrides tau. Once half of them are used, the others divide the rest evenly.
  int max_steps = 1000;
  /// Smallest step, in [0, 1]; overrides tau. If a precise measurement meets a weak prior, a value of 1/1000
  /// already takes effect and costs accuracy.
  Scalar min_step = Scalar(0);
  /// Whether the posterior may correlate orientation and translation; the paper's may not.
  bool keep_coupling = true;
  /// Smallest second moment of the orientation: 1e-10 is a standard deviation of 0.0011 degrees. If the prior
  /// has a smaller one, that is the limit. In float, a moment below the default is lost to rounding: updates
  /// of a prior that knows an axis to less than 7e-4 rad do not converge.
  Scalar min_eigenvalue = std::max(Scalar(1e-10), std::numeric_limits<Scalar>::epsilon());
  /// How often to start again with tau <- sqrt(tau) when the steps prove too long for the samples.
  int max_restarts = 3;
  /// A posterior with a larger residual is reported as kNotGaussian. One with two modes, say, has a large
  /// residual for every tau, because the samples of a rule cannot follow both.
  Scalar max_final_residual = Scalar(0.6);
  /// Below this log-likelihood of the best sample the result is reported as diverged. For m Gaussian
  /// residuals whose constants are left out: minus half a quantile of chi^2(m).
  Scalar min_log_likelihood = -std::numeric_limits<Scalar>::infinity();
};

/// The result of progressive_update.
template <std::floating_point Scalar>
struct ProgressiveResult {
  BinghamGaussian<Scalar> posterior;               ///< the status says whether to use it
  UpdateStatus status = UpdateStatus::kConverged;  ///< how the update ended
  int steps = 0;                                   ///< of the last start
  int restarts = 0;                                ///< with a larger tau
  long evaluations = 0;                            ///< one for each pose; restarts included
  /// Smallest effective sample size of a step, in points of the rule. At least 4 tau/(1 + tau)^2 times their
  /// number unless step_floor_hit.
  Scalar effective_sample_size = std::numeric_limits<Scalar>::infinity();
  Scalar log_evidence = 0;    ///< log of the likelihood's mean under the prior
  Scalar log_likelihood = 0;  ///< the best of the samples of the last step
  /// Normalised innovation squared, as in UpdateResult, from the samples of the last step: with RichPoseRule
  /// and linear measurements within about .1, so it may be slightly negative. 0, not assessed, if the
  /// conditional covariance of the translation is singular before or after the update.
  Scalar nis = 0;
  /// Standard deviation over the posterior of log(prior likelihood / posterior): what the density leaves
  /// unexplained. Well below 1 if the density is the posterior. 0, not assessed, if the prior's conditional
  /// covariance of the translation is singular or max_final_residual is infinite.
  Scalar residual = 0;
  bool step_floor_hit = false;    ///< max_steps or min_step forced a step longer than tau allows
  bool moment_floor_hit = false;  ///< the orientation is as concentrated as min_eigenvalue allows
};

namespace detail {

template <class Scalar>
void check_options(const ProgressiveOptions<Scalar>& options) {
  if (!(options.tau > Scalar(0) && options.tau < Scalar(1))) [[unlikely]] {
    throw_invalid("tau is not inside (0, 1)", options.tau);
  }
  if (!(options.max_steps > 0)) [[unlikely]] {
    throw_invalid("max_steps is not positive", options.max_steps);
  }
  if (!(options.min_step >= Scalar(0) && options.min_step <= Scalar(1))) [[unlikely]] {
    throw_invalid("min_step is not in [0, 1]", options.min_step);
  }
  if (options.max_restarts < 0) [[unlikely]] {
    throw_invalid("max_restarts is negative", options.max_restarts);
  }
  if (!(options.min_eigenvalue >= Scalar(kLeastFloor) && options.min_eigenvalue <= Scalar(0.25)))
      [[unlikely]] {
    throw_invalid("min_eigenvalue is not in [1e-15, 1/4]", options.min_eigenvalue);
  }
  if (!(options.max_final_residual > Scalar(0))) [[unlikely]] {
    throw_invalid("max_final_residual is not positive", options.max_final_residual);
  }
  if (std::isnan(options.min_log_likelihood)) [[unlikely]] {
    throw_invalid("min_log_likelihood is not a number", options.min_log_likelihood);
  }
}

template <class Scalar>
struct ProgressionAttempt {
  Scalar tau;
  bool may_give_up;
};

/// One run through Alg. 2 from the prior, which `result` holds as its posterior. Returns false if it gave up
/// because the steps are too long.
template <class Scalar, class L, class Rule>
[[nodiscard]] bool progress(L& log_likelihood, const Rule& rule, const ProgressionAttempt<Scalar>& attempt,
                            const ProgressiveOptions<Scalar>& options, ProgressiveResult<Scalar>& result) {
  const BinghamGaussian<Scalar> prior = result.posterior;
  const MomentFloor<Scalar> floor(prior, options.min_eigenvalue);
  BinghamGaussian<Scalar>& density = result.posterior;
  Scalar remaining(1);
  while (remaining > Scalar(kProgressionDone)) {
    auto samples = sample(rule, density);
    Vector<Scalar, Rule::kCount> values;
    evaluate_log_likelihood(log_likelihood, samples.points, values);
    result.evaluations += Rule::kCount;
    const LogRange<Scalar> range = bound_log_likelihoods(samples.weights, values);
    if (!range.valid || !range.supported()) {
      result.status = range.valid ? UpdateStatus::kNoSupport : UpdateStatus::kNotFinite;
      return true;
    }

    const ProgressionStep<Scalar> step = progression_step(remaining, reweighting_step(range, attempt.tau),
                                                          options.min_step, result.steps, options.max_steps);
    const Reweighting<Scalar> change = reweight(step.size, values, samples.weights);
    if (!samples.weights.allFinite()) {  // the range of the log-likelihoods overflows
      result.status = UpdateStatus::kNotFinite;
      return true;
    }
    const auto next =
        moment_match(samples, {.keep_coupling = options.keep_coupling, .min_eigenvalue = floor.value()});
    if (attempt.may_give_up && !step.floored && floor.degenerates(density, next)) return false;

    density = next;
    remaining -= step.size;
    ++result.steps;
    result.log_evidence += change.log_mean;
    result.effective_sample_size = std::min(result.effective_sample_size, change.effective_sample_size);
    result.log_likelihood = range.hi;
    result.step_floor_hit = result.step_floor_hit || step.floored;
    if (remaining <= Scalar(kProgressionDone))
      result.nis = innovation_squared(prior, density, samples, values);
  }
  if (!std::isfinite(result.log_evidence) || !std::isfinite(result.nis)) {  // they overflowed
    result.status = UpdateStatus::kNotFinite;
  }
  result.moment_floor_hit = floor.reached_by(density);
  return true;
}

/// The log-likelihood to second order over a density, for a likelihood that takes Count poses at once.
template <int Count, class Density, class L>
[[nodiscard]] auto local_model_in_blocks(const SqrtGaussian<Density>& density, L& log_likelihood,
                                         long& evaluations) {
  using Scalar = typename Density::Scalar;
  using Local = LocalModel<Scalar, 6>;
  constexpr int kAll = MysovskikhRule<6>::kCount;
  const auto likelihood = [&](const Matrix<Scalar, 8, kAll>& poses, Vector<Scalar, kAll>& values) {
    for (int first = 0; first < kAll; first += Count) {
      Matrix<Scalar, 8, Count> block;
      Vector<Scalar, Count> found;
      for (int k = 0; k < Count; ++k) block.col(k) = poses.col(std::min(first + k, kAll - 1));
      evaluations += Count;
      evaluate_log_likelihood(log_likelihood, block, found);
      for (int k = first; k < std::min(first + Count, kAll); ++k) values[k] = found[k - first];
    }
  };
  const auto standard = MysovskikhRule<6>{}.template standard<Scalar>();
  const auto fit = fit_quadratic(density, Scalar(1), likelihood, standard);
  const bool usable = fit.range.valid && fit.range.supported() && std::isfinite(fit.residual);
  return usable ? std::optional<Local>({fit.model, fit.model.constant}) : std::nullopt;
}

/// Whether prior times likelihood has a second mode: see has_second_mode. False if the covariance of the
/// prior is singular.
template <class Scalar, class L, class Rule>
[[nodiscard]] bool is_ambiguous(const BinghamGaussian<Scalar>& prior, L& log_likelihood, const Rule&,
                                ProgressiveResult<Scalar>& result) {
  using Split = SplitPoseGaussian<Scalar>;
  const Split split = to_split_pose_gaussian(prior);
  if (!root_of(split).positive_definite) return false;
  const auto origin = SqrtGaussian<Split>::of(split);
  const auto posterior = SqrtGaussian<Split>::of(to_split_pose_gaussian(result.posterior)).seen_from(origin);
  const auto evaluate = [&](const Matrix<Scalar, 6, Rule::kCount>& tangents,
                            Vector<Scalar, Rule::kCount>& values) {
    result.evaluations += Rule::kCount;
    evaluate_over<Split>({posterior.mean, Matrix6<Scalar>::Identity()}, log_likelihood, tangents, values);
  };
  const auto local_model = [&](const SqrtGaussian<Split>& density) {
    return local_model_in_blocks<Rule::kCount>(density, log_likelihood, result.evaluations);
  };
  return has_second_mode<Rule::kCount>(origin, posterior, {result.log_evidence}, evaluate, local_model);
}

/// The status of a posterior whose steps are done.
template <class Scalar>
[[nodiscard]] UpdateStatus judge(const ProgressiveResult<Scalar>& result,
                                 const ProgressiveOptions<Scalar>& options) {
  const bool collapsed = result.step_floor_hit && result.moment_floor_hit;
  if (collapsed || result.log_likelihood < options.min_log_likelihood) return UpdateStatus::kDiverged;
  return result.residual <= options.max_final_residual ? UpdateStatus::kConverged
                                                       : UpdateStatus::kNotGaussian;
}

}  // namespace detail

/// The posterior of `prior` and a measurement with the given log-likelihood, either Scalar(pose) or
/// void(8 x Count poses, values) (see log_likelihood.hpp). Throws on invalid options; numerical failures are
/// reported in the status.
template <std::floating_point Scalar, class L, PoseRule<BinghamGaussian<Scalar>> Rule>
[[nodiscard]] ProgressiveResult<Scalar> progressive_update(const BinghamGaussian<Scalar>& prior,
                                                           L&& log_likelihood, const Rule& rule,
                                                           const ProgressiveOptions<Scalar>& options = {}) {
  using std::sqrt;
  static_assert(LogLikelihood<L, Scalar, Rule::kCount>,
                "progressive_update: the log-likelihood must be callable as Scalar(pose) or void(poses, "
                "values); of GaussianMeasurements and RobustMeasurements the model as h(pose, i)");
  detail::check_options(options);
  Scalar tau = options.tau;
  for (ProgressiveResult<Scalar> result{.posterior = prior};; tau = sqrt(tau)) {
    const detail::ProgressionAttempt<Scalar> attempt{tau, result.restarts < options.max_restarts};
    if (detail::progress(log_likelihood, rule, attempt, options, result)) {
      if (result.status != UpdateStatus::kConverged) {
        result.posterior = prior;
        return result;
      }
      if (std::isfinite(options.max_final_residual)) {
        result.residual = detail::unexplained(prior, log_likelihood, rule, result.posterior);
        result.evaluations += Rule::kCount;
      }
      result.status = detail::judge(result, options);
      if (result.status == UpdateStatus::kConverged && std::isfinite(options.max_final_residual) &&
          detail::is_ambiguous(prior, log_likelihood, rule, result)) {
        result.status = UpdateStatus::kNotGaussian;
      }
      return result;
    }
    result = {.posterior = prior, .restarts = result.restarts + 1, .evaluations = result.evaluations};
  }
}

/// Not an update: chosen for a prior of the wrong type, to name the mistake in the error message.
template <ConcentratedDensity Density, class... Rest>
void progressive_update(const Density&, Rest&&...) {
  static_assert(!ConcentratedDensity<Density>,
                "progressive_update: the prior must be a BinghamGaussian; see to_bingham_gaussian");
}

/// How progressive_update_subsets divides the measurements, and what it forgets between the subsets.
template <std::floating_point Scalar>
struct SubsetOptions {
  /// Options of each update. min_log_likelihood applies to all subsets together; max_final_residual is not
  /// used.
  ProgressiveOptions<Scalar> progressive = {};
  /// Most measurements that are applied together.
  int max_size = 30;
  /// Regulariser: between two subsets the square of this is added to every variance of the translation.
  Scalar min_translation_sigma_m = Scalar(0);
  /// Regulariser: between two subsets the concentrations of the orientation are divided by 1 + forgetting;
  /// in [0, 1e-3].
  Scalar forgetting = Scalar(0);
};

namespace detail {

template <class Scalar>
void check_options(const SubsetOptions<Scalar>& options) {
  if (options.max_size < 1) [[unlikely]] {
    throw_invalid("max_size of a subset is not positive", options.max_size);
  }
  if (!(options.min_translation_sigma_m >= Scalar(0)) || !std::isfinite(options.min_translation_sigma_m))
      [[unlikely]] {
    throw_invalid("min_translation_sigma_m is not in [0, inf)", options.min_translation_sigma_m);
  }
  if (!(options.forgetting >= Scalar(0) && options.forgetting <= Scalar(1e-3))) [[unlikely]] {
    throw_invalid("forgetting is not in [0, 1e-3]", options.forgetting);
  }
}

/// The density made a little wider. (The paper adds "a term to the parameter matrix"; a multiple of the
/// identity would change nothing.)
template <class Scalar>
[[nodiscard]] BinghamGaussian<Scalar> regularized(const BinghamGaussian<Scalar>& density,
                                                  const SubsetOptions<Scalar>& options) {
  const Scalar variance = options.min_translation_sigma_m * options.min_translation_sigma_m;
  if (variance == Scalar(0) && options.forgetting == Scalar(0)) return density;
  const auto& orientation = density.orientation();
  return {Bingham<Scalar, 4>::from_parameters(
              orientation.axes(), orientation.concentrations() / (Scalar(1) + options.forgetting)),
          density.mean_translation(), density.coupling(),
          density.conditional_covariance() + variance * Matrix3<Scalar>::Identity()};
}

}  // namespace detail

/// The posterior after `count` independent measurements, applied in subsets of at most max_size, of sizes as
/// equal as possible (DQV-SLAM sec. IV-D). likelihood_of(begin, end) returns the log-likelihood of the
/// measurements begin..end-1.
///
/// The numbers in the result are totals or worst cases over the subsets; the residual is not assessed.
/// Subsets are for comparison with the paper. They save no steps, because ranges of log-likelihoods add up.
/// Throws on invalid options or a negative count.
template <std::floating_point Scalar, class LikelihoodOf, PoseRule<BinghamGaussian<Scalar>> Rule>
requires LogLikelihood<std::invoke_result_t<LikelihoodOf&, int, int>, Scalar, Rule::kCount>
[[nodiscard]] ProgressiveResult<Scalar> progressive_update_subsets(
    const BinghamGaussian<Scalar>& prior, int count, LikelihoodOf&& likelihood_of, const Rule& rule,
    const SubsetOptions<Scalar>& options = {}) {
  detail::check_options(options.progressive);
  detail::check_options(options);
  if (count < 0) [[unlikely]] {
    detail::throw_invalid("number of measurements is negative", count);
  }
  ProgressiveOptions<Scalar> without_final_check = options.progressive;
  without_final_check.min_log_likelihood = ProgressiveOptions<Scalar>{}.min_log_likelihood;
  without_final_check.max_final_residual = std::numeric_limits<Scalar>::infinity();

  ProgressiveResult<Scalar> total{.posterior = prior};
  const int subsets = (count + options.max_size - 1) / options.max_size;
  for (int i = 0; i < subsets; ++i) {
    const auto boundary = [&](int k) {
      return static_cast<int>(static_cast<long long>(count) * k / subsets);
    };
    const auto& start = i == 0 ? prior : detail::regularized(total.posterior, options);
    const auto result =
        progressive_update(start, likelihood_of(boundary(i), boundary(i + 1)), rule, without_final_check);
    total.posterior = result.posterior;
    total.status = result.status;
    total.steps += result.steps;
    total.restarts += result.restarts;
    total.evaluations += result.evaluations;
    total.effective_sample_size = std::min(total.effective_sample_size, result.effective_sample_size);
    total.log_evidence += result.log_evidence;
    total.log_likelihood += result.log_likelihood;
    total.nis += result.nis;
    total.step_floor_hit = total.step_floor_hit || result.step_floor_hit;
    total.moment_floor_hit = result.moment_floor_hit;
    if (result.status != UpdateStatus::kConverged) {
      total.posterior = prior;
      return total;
    }
  }
  total.status = detail::judge(total, options.progressive);
  return total;
}

}  // namespace antipode
