// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "stereo_slam/evaluation/pose_matching.hpp"

/// Poses that are not on the path of their own trajectory.
namespace stereo_slam {

/// A step from one matched pose to the next that is much too long.
struct PoseJump {
  std::size_t pair = 0;     ///< the step leads to this pair of poses
  double length_m = 0.0;    ///< of the step
  double expected_m = 0.0;  ///< what the other trajectory moves meanwhile, in the scale of this one
};

/// The jumps in both trajectories.
struct PoseJumps {
  std::vector<PoseJump> truth;
  std::vector<PoseJump> estimate;
};

/// The steps that are longer than 5 cm, five times the step of the other trajectory and five times the usual
/// step of their own: a tracker or a SLAM that lost the body writes zeros, or the last pose again and again.
[[nodiscard]] PoseJumps find_jumps(const PosePairs& poses);

}  // namespace stereo_slam
