// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/pose_jumps.hpp"

#include <algorithm>

#include "stereo_slam/core/median.hpp"

namespace stereo_slam {
namespace {

constexpr double kLeast_m = 0.05;
constexpr double kTimesLonger = 5.0;

[[nodiscard]] std::vector<double> steps_of(const std::vector<Eigen::Isometry3d>& poses) {
  std::vector<double> steps_m;
  for (std::size_t i = 1; i < poses.size(); ++i)
    steps_m.push_back((poses[i].translation() - poses[i - 1].translation()).norm());
  return steps_m;
}

/// A step that is usual while the body moves: three of four are shorter.
[[nodiscard]] double usual_step_m(const std::vector<double>& steps_m) { return quantile(steps_m, 0.75); }

[[nodiscard]] std::vector<PoseJump> jumps_in(const std::vector<double>& steps_m,
                                             const std::vector<double>& other_m) {
  const double usual_m = usual_step_m(steps_m), other_usual_m = usual_step_m(other_m);
  // Of bodies that stand, only noise has a scale; so it makes the bound no smaller.
  const double scale = other_usual_m > 0.0 ? std::max(1.0, usual_m / other_usual_m) : 1.0;
  std::vector<PoseJump> jumps;
  for (std::size_t i = 0; i < steps_m.size(); ++i) {
    const double expected_m = scale * other_m[i];
    if (steps_m[i] > std::max(kLeast_m, kTimesLonger * std::max(expected_m, usual_m)))
      jumps.push_back({i + 1, steps_m[i], expected_m});
  }
  return jumps;
}

}  // namespace

PoseJumps find_jumps(const PosePairs& poses) {
  const std::vector<double> truth_m = steps_of(poses.truth), estimate_m = steps_of(poses.estimate);
  return {jumps_in(truth_m, estimate_m), jumps_in(estimate_m, truth_m)};
}

}  // namespace stereo_slam
