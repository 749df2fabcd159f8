// SPDX-License-Identifier: MIT
#pragma once

/// @file
/// How an update ended.
namespace antipode {

/// How the update of a density by a likelihood ended. A filter keeps its prior unless the status is
/// kConverged.
enum class UpdateStatus {
  kConverged,    ///< the steps settled, and the residual is at most max_final_residual of the options
  kNotGaussian,  ///< the steps settled, but the residual is above max_final_residual, or there is a second
                 ///< mode: the update's model does not describe the likelihood. The covariance of
                 ///< linearized_update includes what its models leave out; the covariance of the other
                 ///< updates may be far too small
  kDiverged,     ///< do not use the posterior. It does not explain the measurement (see min_log_likelihood of
                 ///< the options), the steps did not settle, the density collapsed to its floor, or models of
                 ///< the measurement led more than half a turn away (then the posterior is the prior)
  kNoSupport,    ///< no sample explains the measurement: all log-likelihoods -infinity. The posterior is the
                 ///< prior
  kNotFinite,    ///< a log-likelihood was NaN, +infinity or too large to compute with. The posterior is the
                 ///< prior
};

}  // namespace antipode
