// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/filters/update_status.hpp>

/// @file
/// What an update returns.
namespace antipode {

/// The result of the Bayes update of a concentrated density.
template <ConcentratedDensity Density>
struct UpdateResult {
  using Scalar = typename Density::Scalar;  ///< of states and densities

  Density posterior;                               ///< the status says whether to use it
  UpdateStatus status = UpdateStatus::kConverged;  ///< how the update ended
  int steps = 0;         ///< steps of the progression, or linear models of the measurement
  long evaluations = 0;  ///< poses at which the likelihood or the measurement model was evaluated
  /// Log of the likelihood's mean under the prior. As exact as the posterior is Gaussian: to 0.1 for
  /// residuals up to 0.1, but 2 too low for a likelihood with heavy tails under a prior 20 times as wide
  /// (residual 0.3).
  Scalar log_evidence = 0;
  Scalar log_likelihood = 0;  ///< best of the last samples; for updates by linear models, at the last mean
  /// Normalised innovation squared (NIS). For a linear measurement, (z - h)^T S^-1 (z - h): chi-square with
  /// as many degrees of freedom as there are measured numbers. For any likelihood, the least value over the
  /// states of: squared distance from the prior minus twice the log-likelihood.
  Scalar nis = 0;
  /// What the update's model leaves unexplained over the posterior. For quadratic_update, the standard
  /// deviation of the log-likelihood's remainder. For updates by linear models, the root of the sum of
  /// tr(R^-1 Omega): the remainder of each measurement in standard deviations of its noise. Well below 1 if
  /// the posterior is Gaussian.
  Scalar residual = 0;
  bool limit_hit = false;  ///< the allowed number of steps or iterations was too small
};

namespace detail {

/// How an update ended, as the result for another density: a part of its own or another form of it.
template <class Density, class Result>
[[nodiscard]] UpdateResult<Density> as_result_of(const Density& posterior, const Result& result,
                                                 bool limit_hit) {
  return {.posterior = posterior,
          .status = result.status,
          .steps = result.steps,
          .evaluations = result.evaluations,
          .log_evidence = result.log_evidence,
          .log_likelihood = result.log_likelihood,
          .nis = result.nis,
          .residual = result.residual,
          .limit_hit = limit_hit};
}

}  // namespace detail

/// The result for a pose in the screw chart.
template <std::floating_point Scalar>
using PoseUpdateResult = UpdateResult<PoseGaussian<Scalar>>;

}  // namespace antipode
