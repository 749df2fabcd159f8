// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/frontend/plane_warp.hpp"
#include "stereo_slam/rig/displacement_estimation.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// The displacement of the right image of a frame against that of `view`, from points that are known in the
/// frame before, and the motion between the frames, relative to the expected one. `prior` is what is known of
/// the displacement.
///
/// Optical flow finds the points in the left image, see follow_in_left(). Around where their disparities put
/// them in the right one, a window of several pixels is searched for the patch of the left image; the best
/// place is refined to a fraction of a pixel. Nothing if fewer than 15 points agree, or fewer than half of
/// those that were found.
[[nodiscard]] std::optional<DisplacementEstimate> search_displacement(
    const std::vector<StereoPlane>& previous, const ConsecutivePyramids& pyramids, const StereoView& view,
    const Pose& expected_T_previous_current, const DisplacementPrior& prior,
    const OdometrySettings& settings);

}  // namespace stereo_slam
