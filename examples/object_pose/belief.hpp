// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "pose_evidence.hpp"

/// Statistics of a belief.
namespace object_pose {

/// The differential entropy -E[log p] in nats, estimated from random draws.
[[nodiscard]] double entropy(const Belief& belief, std::uint64_t seed = 1);

/// The probability of all poses with a higher density than `pose`, estimated from random draws. The pose lies
/// in the 95 % region of the mixture if this is at most 0.95.
[[nodiscard]] double mass_above(const Belief& belief, const Pose& pose, std::uint64_t seed = 1);

/// Mean and spread of a belief.
struct PoseSummary {
  Pose pose;                                       ///< the mean of the mixture
  double rotation_sigma_rad, translation_sigma_m;  ///< root mean square distances from the mean
};
/// The mean pose and the standard deviations, by moment matching.
[[nodiscard]] PoseSummary summarize(const Belief& belief);

/// Angle and distance between two poses.
struct PoseError {
  double rotation_deg, translation_cm;
};
[[nodiscard]] PoseError error_of(const Pose& estimate, const Pose& truth);

}  // namespace object_pose
