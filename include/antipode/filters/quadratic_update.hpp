// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>

#include <antipode/concepts.hpp>
#include <antipode/detail/check.hpp>
#include <antipode/distributions/detail/positive_semidefinite.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/progression.hpp>
#include <antipode/filters/detail/rooted_pose.hpp>
#include <antipode/filters/pose_gaussian.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/update_status.hpp>
#include <antipode/sampling/gaussian_rules.hpp>
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
/// and take the exact step of that model. The step is as long as the model holds, measured by rho, the
/// standard deviation of what it leaves unexplained over the current density; how informative the measurement
/// is does not matter. A linear model with Gaussian noise takes one step and is the Kalman update. No
/// derivatives are needed, and robust or other non-Gaussian likelihoods are welcome as long as the posterior
/// has one mode that the prior reaches: a cap that hides most of the measurement from most of the prior
/// leaves no slope to follow. For wide or multimodal densities use progressive_update.
namespace antipode {

template <std::floating_point Scalar>
struct QuadraticUpdateOptions {
  /// What a step may leave unexplained of the log-likelihood, as a standard deviation: a step is at most
  /// max_residual/rho.
  Scalar max_residual = Scalar(0.25);
  /// Most steps, whatever max_residual asks for: once half of them are used, the others share what remains
  /// evenly. Refinements come on top.
  int max_steps = 100;
  /// Most fits around the result that start from the original prior again. They remove what the first, wide
  /// fits got wrong, a few tenths of a standard deviation.
  int refinements = 1;
  /// Below this log-likelihood at the posterior's samples (the best of them) the result is reported as
  /// diverged.
  Scalar min_log_likelihood = -std::numeric_limits<Scalar>::infinity();
};

namespace detail {

/// The quadratic model of a log-likelihood over a density.
template <class Scalar>
struct QuadraticFit {
  QuadraticLogLikelihood<Scalar> model;
  Scalar residual = 0;     ///< standard deviation of what the model leaves unexplained
  LogRange<Scalar> range;  ///< the rest is set only if it is valid and supported
};

/// Asks the likelihood at the points of a rule for N(0, I) and projects it onto Hermite polynomials.
template <class Scalar, class L, int Count>
[[nodiscard]] QuadraticFit<Scalar> fit_quadratic(const RootedPose<Scalar>& density, L& log_likelihood,
                                                 const WeightedSamples<Scalar, 6, Count>& standard) {
  using std::sqrt;
  Matrix<Scalar, 8, Count> poses;
  for (int k = 0; k < Count; ++k) {
    poses.col(k) = density.pose.boxplus(density.L * standard.points.col(k)).coeffs();
  }
  Vector<Scalar, Count> values;
  evaluate_log_likelihood(log_likelihood, poses, values);
  QuadraticFit<Scalar> fit;
  fit.range = bound_log_likelihoods(standard.weights, values);
  if (!fit.range.valid || !fit.range.supported()) return fit;

  const Scalar mean = standard.weights.dot(values);
  Vector<Scalar, Count> errors = values.array() - mean;
  Matrix6<Scalar> hessian = Matrix6<Scalar>::Zero();
  fit.model.gradient = standard.points * standard.weights.cwiseProduct(errors);
  for (int k = 0; k < Count; ++k) {
    hessian += standard.weights[k] * errors[k] * standard.points.col(k) * standard.points.col(k).transpose();
  }
  for (int k = 0; k < Count; ++k) {
    const auto y = standard.points.col(k);
    errors[k] -= y.dot(fit.model.gradient + Scalar(0.5) * hessian * y) - Scalar(0.5) * hessian.trace();
  }
  fit.residual = sqrt(standard.weights.dot(errors.cwiseAbs2()));
  fit.model.curvature = without_negative_eigenvalues<Scalar, 6>(-hessian);
  fit.model.constant = mean + Scalar(0.5) * fit.model.curvature.trace();
  return fit;
}

/// Whether a density in the whitened coordinates of another is about where that one is, so that a fit to
/// that one tells about it: two standard deviations, one and a half times the variance.
template <class Scalar>
[[nodiscard]] bool is_near_standard(const ConditionedGaussian<Scalar>& y) {
  return y.mean.squaredNorm() <= Scalar(4) && y.root.squaredNorm() <= Scalar(1.5 * 6);
}

template <class Scalar>
void check_options(const QuadraticUpdateOptions<Scalar>& options) {
  if (!(options.max_residual > Scalar(0))) [[unlikely]] {
    throw_invalid("max_residual is not positive", options.max_residual);
  }
  if (options.max_steps < 1) [[unlikely]] {
    throw_invalid("max_steps is not positive", options.max_steps);
  }
  if (options.refinements < 0) [[unlikely]] {
    throw_invalid("refinements is negative", options.refinements);
  }
  if (std::isnan(options.min_log_likelihood)) [[unlikely]] {
    throw_invalid("min_log_likelihood is not a number", options.min_log_likelihood);
  }
}

}  // namespace detail

/// The posterior of `prior` and a measurement with the given log-likelihood, either Scalar(pose) or
/// void(8 x Count poses, values) (see concepts.hpp). The rule must be exact to degree 5. Throws on invalid
/// options and covariances; what can go wrong with the numbers comes back as the status.
template <std::floating_point Scalar, class L, GaussianRule Rule = MysovskikhRule<6>>
requires(Rule::kDim == 6 && LogLikelihood<L, Scalar, Rule::kCount>)
    [[nodiscard]] PoseUpdateResult<Scalar> quadratic_update(
        const PoseGaussian<Scalar>& prior, L&& log_likelihood,
        const QuadraticUpdateOptions<Scalar>& options = {}, const Rule& rule = {}) {
  detail::check_options(options);
  const auto origin = detail::RootedPose<Scalar>::of(prior, options.refinements > 0);
  const auto standard = rule.template standard<Scalar>();
  PoseUpdateResult<Scalar> result{.posterior = prior};
  detail::RootedPose<Scalar> density = origin;
  const auto fit_density = [&] {
    const auto fit = detail::fit_quadratic(density, log_likelihood, standard);
    result.evaluations += Rule::kCount;
    result.log_likelihood = fit.range.hi;
    result.residual = fit.residual;
    if (!fit.range.valid || !std::isfinite(fit.residual)) {
      result.status = UpdateStatus::kNotFinite;
    } else if (!fit.range.supported()) {
      result.status = UpdateStatus::kNoSupport;
    }
    return fit;
  };

  for (Scalar remaining(1); remaining > Scalar(detail::kProgressionDone);) {
    const auto fit = fit_density();
    if (result.status != UpdateStatus::kConverged) return result;
    const auto step = detail::progression_step(remaining, options.max_residual / fit.residual, Scalar(0),
                                               result.steps, options.max_steps);
    const auto y = detail::condition<Scalar>(Vector6<Scalar>::Zero(), Matrix6<Scalar>::Identity(),
                                             fit.model.scaled(step.size));
    density = density.moved(y);
    remaining -= step.size;
    ++result.steps;
    result.log_evidence += y.log_evidence;
    result.limit_hit = result.limit_hit || step.floored;
  }
  while (result.refinements < options.refinements) {
    const auto fit = fit_density();
    if (result.status != UpdateStatus::kConverged) return result;
    const auto y = density.condition_prior(origin, fit.model);
    if (!detail::is_near_standard(y)) break;
    density = density.moved(y);
    ++result.refinements;
    result.log_evidence = y.log_evidence;
  }
  result.posterior = density.density();
  if (result.log_likelihood < options.min_log_likelihood) result.status = UpdateStatus::kDiverged;
  return result;
}

}  // namespace antipode
