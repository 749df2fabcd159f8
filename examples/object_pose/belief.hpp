// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "pose_evidence.hpp"

/// What is asked of a belief.
namespace object_pose {

/// The differential entropy -E[log p] in nats, by draws.
[[nodiscard]] double entropy(const Belief& belief, std::uint64_t seed = 1);

/// The probability of all poses that are more probable than this one: it lies in the mixture's 95 % region if
/// this is at most 0.95.
[[nodiscard]] double mass_above(const Belief& belief, const Pose& pose, std::uint64_t seed = 1);

struct PoseSummary {
  Pose pose;                                       ///< the mean of the mixture
  double rotation_sigma_rad, translation_sigma_m;  ///< root mean square distances from it
};
[[nodiscard]] PoseSummary summarize(const Belief& belief);

struct PoseError {
  double rotation_deg, translation_cm;
};
[[nodiscard]] PoseError error_of(const Pose& estimate, const Pose& truth);

}  // namespace object_pose
