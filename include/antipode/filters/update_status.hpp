// SPDX-License-Identifier: MIT
#pragma once

namespace antipode {

/// How the update of a density by a likelihood ended.
enum class UpdateStatus {
  kConverged,
  kDiverged,   ///< do not use the posterior. It does not explain the measurement (see min_log_likelihood of
               ///< the options), the steps did not settle, or models of the measurement led more than half a
               ///< turn away (then it is the prior)
  kNoSupport,  ///< no sample explains the measurement: all log-likelihoods -infinity. The posterior is the
               ///< prior
  kNotFinite,  ///< a log-likelihood was NaN, +infinity or too large to compute with. The posterior is the
               ///< prior
};

}  // namespace antipode
