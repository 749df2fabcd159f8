// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/calibration/stereo_rig.hpp"
#include "stereo_slam/core/stereo_camera.hpp"

/// Checks of cameras that come from a program, not from a file.
namespace stereo_slam {

/// Throws std::invalid_argument that names the values unless focal lengths [px] and baseline [m] are from
/// 1e-6 to 1e6 and the principal point is finite. If the camera has a size, it must be one of images that are
/// read, and the principal point inside them.
void require_valid(const StereoCamera& camera);

/// The same for both lenses of raw cameras. Their coefficients must be as many as the model has, and
/// T_right_left and T_body_left rigid motions.
void require_valid(const StereoRig& rig);

}  // namespace stereo_slam
