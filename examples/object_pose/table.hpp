// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <ostream>
#include <vector>

#include "estimate.hpp"

namespace object_pose {

/// What an estimate was made from, and its stages.
struct EstimateRecord {
  const std::vector<Stage>& stages;
  const FeatureModel& model;
  const std::vector<Match>& matches;
  const BoxModel& box;
  const std::optional<Pose>& ground_truth;
};

/// A line for each feature: the number of components, the uncertainty of the pose, and its error if the
/// ground truth is known.
void print_table(std::ostream& stream, const EstimateRecord& record);

/// The pose and its standard deviations.
void print_pose(std::ostream& stream, const Belief& belief, const std::optional<Pose>& truth);

}  // namespace object_pose
