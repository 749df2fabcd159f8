// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Distributes the prediction error over untracked frames.
///
/// Untracked frames were predicted from the tracked frame before them. Each takes a share of the error at the
/// next tracked frame, in proportion to the standard deviation of its predicted position, and its covariance
/// is interpolated between its own and that of the tracked frame. Untracked frames at the end keep their
/// predicted poses. `tracked` has one value a pose.
void bridge_untracked(std::vector<PoseGaussian>& T_world_camera, const std::vector<bool>& tracked);

}  // namespace stereo_slam
