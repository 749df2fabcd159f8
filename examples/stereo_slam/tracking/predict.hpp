// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/odometry/constant_velocity.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// The motion since the last frame (eq. 11) with the covariance of its noise v_k: that of the odometry, or,
/// where it is a guess, one that grows with the unseen steps.
[[nodiscard]] PoseGaussian motion_with_noise(const PoseGaussian& T_previous_current, bool odometry_valid,
                                             const MotionSettings& settings, const UnseenSteps& unseen = {});

/// Prior T_keyframe_camera of the current frame from the posterior of the last frame and the motion since.
[[nodiscard]] PoseGaussian predict_pose(const PoseGaussian& posterior, const PoseGaussian& motion);

/// The same through 7 x 7 points, as in the paper (eqs. 5-7): its independent model drops the correlation of
/// orientation and translation.
[[nodiscard]] PoseDensity predict_as_in_paper(const PoseDensity& posterior, const PoseGaussian& motion);

}  // namespace stereo_slam
