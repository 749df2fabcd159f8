// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Lays the poses of frames in which nothing was seen between those of the frames before and after them.
///
/// They were predicted from the frame before alone. What that missed the frame after by is handed out over
/// them in equal parts, and their covariances go over from the predicted ones to that of the frame after.
/// Unseen frames at the end stay as predicted. `seen` has one value a pose.
void bridge_unseen(std::vector<PoseGaussian>& T_world_camera, const std::vector<bool>& seen);

}  // namespace stereo_slam
