// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/image_displacement.hpp"

namespace stereo_slam {

/// The error of the disparities of points of the previous frame, from where the left image of the current one
/// shows them, px and without the errors of the lens: with wrong disparities, near and far points disagree
/// about the motion. It needs neither a prediction of the motion nor the right image of the current frame.
/// Errors of up to 12 px are searched. Nothing if fewer than 15 points agree on a motion, or fewer than a
/// third: optical flow without a prediction is often wrong.
[[nodiscard]] std::optional<SharedDisparityError> find_shared_disparity_error(
    std::span<const StereoPoint> previous, std::span<const Vector2<double>> current_px,
    const StereoCamera& camera, double pixel_sigma_px);

}  // namespace stereo_slam
