// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/rig/rectification_estimator.hpp"

namespace stereo_slam {

/// What a run learned of its cameras, from which a run with the same cameras can begin.
struct LearnedCameras {
  StereoCamera camera;  ///< as calibrated
  RectificationEstimate estimate;
};

}  // namespace stereo_slam
