// SPDX-License-Identifier: MIT
#pragma once

/// @file
/// How an update ended.
namespace antipode {

/// How the update of a density by a likelihood ended: the same for every update. A filter keeps its prior
/// unless it is kConverged.
enum class UpdateStatus {
  kConverged,    ///< the steps settled, and the residual is at most max_final_residual of the options
  kNotGaussian,  ///< the steps settled, but the residual is above max_final_residual, or there is a second
                 ///< mode: the likelihood is not what the update's model of it says. The covariance of
                 ///< linearized_update contains what its models leave out, that of the others may be far too
                 ///< small
  kDiverged,     ///< do not use the posterior. It does not explain the measurement (see min_log_likelihood of
                 ///< the options), the steps did not settle, the density collapsed to its floor, or models of
                 ///< the measurement led more than half a turn away (then it is the prior)
  kNoSupport,    ///< no sample explains the measurement: all log-likelihoods -infinity. The posterior is the
                 ///< prior
  kNotFinite,    ///< a log-likelihood was NaN, +infinity or too large to compute with. The posterior is the
                 ///< prior
};

}  // namespace antipode
