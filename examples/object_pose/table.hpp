// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <ostream>
#include <vector>

#include "estimate.hpp"

namespace object_pose {

/// A line for each feature: what became of the components, how uncertain the pose is, and how wrong if the
/// truth is known.
void print_table(std::ostream& stream, const std::vector<Stage>& stages, const FeatureModel& model,
                 const std::vector<Match>& matches, const BoxModel& box, const std::optional<Pose>& truth);

/// The pose and its standard deviations.
void print_pose(std::ostream& stream, const Belief& belief, const std::optional<Pose>& truth);

}  // namespace object_pose
