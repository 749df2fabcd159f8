// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"

namespace stereo_slam {

/// Constraints on the rectification residual from landmarks that were measured in their keyframe and again
/// from `T_keyframe_camera`.
[[nodiscard]] std::vector<BiasConstraint> bias_constraints(const std::vector<Match>& matches,
                                                           const MapView& map, const Pose& T_keyframe_camera);

}  // namespace stereo_slam
