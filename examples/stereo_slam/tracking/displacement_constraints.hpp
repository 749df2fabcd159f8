// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/odometry/displacement_estimation.hpp"

namespace stereo_slam {

/// Constraints on the camera's pose and on the displacement of its right image from landmarks that were
/// measured with `rectification`, linearised at `T_keyframe_camera`: from `most` of the matches, evenly
/// chosen, or from all if they are fewer.
[[nodiscard]] std::vector<DisplacementConstraint> displacement_constraints(
    const std::vector<Match>& matches, const MapView& map, const RectificationResidual& rectification,
    const Pose& T_keyframe_camera, std::size_t most);

}  // namespace stereo_slam
