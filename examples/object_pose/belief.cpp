// SPDX-License-Identifier: MIT
#include "belief.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <antipode/sampling/mixture_moments.hpp>

namespace object_pose {
namespace {

constexpr int kDraws = 2000;

}  // namespace

double entropy(const Belief& belief, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  double sum = 0.0;
  for (int k = 0; k < kDraws; ++k) sum -= belief.log_density(belief.sample(rng));
  return sum / kDraws;
}

double mass_above(const Belief& belief, const Pose& pose, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  const double level = belief.log_density(pose);
  int above = 0;
  for (int k = 0; k < kDraws; ++k) above += belief.log_density(belief.sample(rng)) > level ? 1 : 0;
  return static_cast<double>(above) / kDraws;
}

PoseSummary summarize(const Belief& belief) {
  const auto matched = antipode::moment_match(belief);
  const auto variances = matched.covariance().diagonal().eval();
  return {matched.pose(), std::sqrt(variances.head<3>().sum()), std::sqrt(variances.tail<3>().sum())};
}

PoseError error_of(const Pose& estimate, const Pose& truth) {
  const auto xi = estimate.boxminus(truth);
  return {xi.head<3>().norm() * 180.0 / std::numbers::pi,
          100.0 * (estimate.translation() - truth.translation()).norm()};
}

}  // namespace object_pose
