// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "associate.hpp"
#include "camera/stereo_camera.hpp"
#include "landmark.hpp"
#include "rectification.hpp"
#include "types.hpp"

namespace stereo_slam {

/// What landmarks, seen from their keyframe and again from the camera at `T_keyframe_camera`, tell about the
/// rectification.
[[nodiscard]] std::vector<BiasConstraint> bias_constraints(const std::vector<Match>& matches,
                                                           const std::vector<Landmark>& landmarks,
                                                           const Pose& T_keyframe_camera,
                                                           const StereoCamera& camera);

}  // namespace stereo_slam
