// SPDX-License-Identifier: MIT
// Updates by a log-likelihood that may be anything.
#include <optional>

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "fuzz/fuzz_target.hpp"
#include "fuzz/hostile_input.hpp"
#include "fuzz/hostile_measurement.hpp"

namespace antipode::fuzz {
namespace {

void quadratic(Bytes bytes) {
  HostileInput input(bytes);
  const auto prior = hostile_prior(input);
  const auto likelihood = hostile_function(input);
  allow_refusal([&] { require_honest(quadratic_update(prior, likelihood), prior); }, "pose covariance");
}

void progressive(Bytes bytes) {
  HostileInput input(bytes);
  std::optional<BinghamGaussian<double>> prior;
  allow_refusal([&] { prior = to_bingham_gaussian(hostile_prior(input)); });
  if (!prior) return;
  require_honest(progressive_update(*prior, hostile_function(input), JointPoseRule{}, {.max_steps = 50}));
}

}  // namespace

std::vector<Target> likelihood_update_targets() {
  return {{"quadratic_update", quadratic}, {"progressive_update", progressive}};
}

}  // namespace antipode::fuzz
