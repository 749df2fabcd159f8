// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/filters/update_status.hpp>

namespace antipode {

/// What the Bayes update of a concentrated pose density came to.
template <std::floating_point Scalar>
struct PoseUpdateResult {
  PoseGaussian<Scalar> posterior;
  UpdateStatus status = UpdateStatus::kConverged;
  int steps = 0;              ///< models of the measurement that the prior was conditioned on
  long evaluations = 0;       ///< poses that the likelihood or the measurement model was asked at
  Scalar log_evidence = 0;    ///< log of the likelihood's mean under the prior
  Scalar log_likelihood = 0;  ///< the best one among the last samples
  Scalar residual = 0;        ///< standard deviation of what the last fit leaves unexplained of the
                              ///< log-likelihood: well below 1 if the posterior is Gaussian
  bool limit_hit = false;     ///< the allowed number of steps or iterations was too small
};

}  // namespace antipode
