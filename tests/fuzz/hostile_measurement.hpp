// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

#include "fuzz/hostile_input.hpp"

namespace antipode::fuzz {

using AnyFunction = std::function<double(const DualQuaternion<double>&)>;

/// A function of the pose that may jump, be infinite, or be no number; the same for x and -x.
[[nodiscard]] AnyFunction hostile_function(HostileInput& input);

/// Not beyond 1e100, whose square does not overflow: no density is computed with beyond that.
[[nodiscard]] double bounded(double x);

/// A pose near the origin with any covariance.
[[nodiscard]] PoseGaussian<double> hostile_prior(HostileInput& input);

/// Throws BrokenClaim unless a result is what its status says. `prior` was accepted.
void require_honest(const PoseUpdateResult<double>& result, const PoseGaussian<double>& prior);
void require_honest(const ProgressiveResult<double>& result);

}  // namespace antipode::fuzz
