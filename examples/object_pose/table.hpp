// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <ostream>
#include <vector>

#include "estimate.hpp"

namespace object_pose {

/// The stages of an estimate, and what they refer to.
struct EstimateRecord {
  const std::vector<Stage>& stages;
  const FeatureModel& model;
  const std::vector<Match>& matches;
  const BoxModel& box;
  const std::optional<Pose>& ground_truth;
};

/// Prints a line for each feature: its face, the numbers of components (pairs, accepted pairs, left after
/// dropping, left after merging), the log evidence, the entropy of the belief [nats], the error of the mean
/// pose if the ground truth is known, and the verdict.
void print_table(std::ostream& stream, const EstimateRecord& record);

/// Prints the mean pose, its standard deviations and, if the ground truth is known, the probability of all
/// poses with a higher density than that of the ground truth.
void print_pose(std::ostream& stream, const Belief& belief, const std::optional<Pose>& truth);

}  // namespace object_pose
