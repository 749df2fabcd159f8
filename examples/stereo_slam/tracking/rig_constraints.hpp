// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/odometry/two_view_adjustment.hpp"
#include "stereo_slam/rig/displacement_estimation.hpp"
#include "stereo_slam/rig/seen_motion.hpp"
#include "stereo_slam/rig/stereo_view.hpp"

namespace stereo_slam {

// What landmarks and points of the odometry show of the rig.

/// The motion from the keyframe to `T_keyframe_camera`, with the landmarks, which were measured in their
/// keyframe and again from there.
[[nodiscard]] SeenMotion seen_motion(const std::vector<Match>& matches, const MapView& map,
                                     const Pose& T_keyframe_camera);

/// The motion between two frames, with points of the odometry, which were measured in both.
[[nodiscard]] SeenMotion seen_motion(const std::vector<StereoCorrespondence>& points,
                                     const Pose& T_previous_current, const StereoCamera& camera);

/// Constraints on the camera's pose and on the displacement of its right image from landmarks that were
/// measured in `view`, linearised at `T_keyframe_camera`: from `most` of the matches, evenly chosen, or from
/// all if they are fewer.
[[nodiscard]] std::vector<DisplacementConstraint> displacement_constraints(const std::vector<Match>& matches,
                                                                           const MapView& map,
                                                                           const StereoView& view,
                                                                           const Pose& T_keyframe_camera,
                                                                           std::size_t most);

}  // namespace stereo_slam
