// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/odometry/two_view_adjustment.hpp"

namespace stereo_slam {

/// Constraints on the rectification residual from landmarks that were measured in their keyframe and again
/// from `T_keyframe_camera`.
[[nodiscard]] std::vector<BiasConstraint> bias_constraints(const std::vector<Match>& matches,
                                                           const MapView& map, const Pose& T_keyframe_camera);

/// Constraints from points of the odometry, which were measured in the previous frame and again in this one.
[[nodiscard]] std::vector<BiasConstraint> bias_constraints(const std::vector<StereoCorrespondence>& points,
                                                           const Pose& T_previous_current,
                                                           const StereoCamera& camera);

}  // namespace stereo_slam
