// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"

namespace stereo_slam {

/// What landmarks, seen from their keyframe and again from the camera at `T_keyframe_camera`, tell about the
/// rectification.
[[nodiscard]] std::vector<BiasConstraint> bias_constraints(const std::vector<Match>& matches,
                                                           const std::vector<Landmark>& landmarks,
                                                           const Pose& T_keyframe_camera,
                                                           const StereoCamera& camera);

}  // namespace stereo_slam
