// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <random>
#include <span>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/odometry/two_view_adjustment.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// T_previous_current of two stereo frames that may be far apart, from correspondences most of which may be
/// wrong: RANSAC over three points of the previous frame and their positions in the current left image. An
/// inlier is within settings.max_reprojection_error_px in (u, v, d). Draws until a pose that `fewest_inliers`
/// agree with would have been found, at most settings.ransac_iterations times. Nothing if no pose has four
/// inliers.
///
/// Three points are not tried if the distances between them differ in the two frames by more than the noise
/// of the disparities, settings.pixel_sigma_px, explains. Most samples with a wrong correspondence end there.
[[nodiscard]] std::optional<Pose> perspective_pose(std::span<const StereoCorrespondence> correspondences,
                                                   int fewest_inliers, const StereoCamera& camera,
                                                   const LoopVerificationSettings& settings,
                                                   std::mt19937_64& random);

}  // namespace stereo_slam
