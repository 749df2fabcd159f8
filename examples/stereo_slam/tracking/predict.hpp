// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/odometry/constant_velocity.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// A motion measured by the odometry with the least noise that it has: 0.2 mrad and 2 mm in each axis are
/// added to its own.
[[nodiscard]] PoseGaussian with_least_noise(PoseGaussian T_previous_current);

/// Prior T_keyframe_camera of the current frame from the posterior of the last frame and the odometry (eq.
/// 11). Without a valid odometry, T_previous_current is a guess and the noise grows with the unseen steps.
[[nodiscard]] PoseDensity predict_pose(const PoseDensity& posterior, const PoseGaussian& T_previous_current,
                                       bool odometry_valid, const MotionSettings& settings,
                                       const UnseenSteps& unseen = {});

/// The same through 7 x 7 points, as in the paper (eqs. 5-7): its independent model drops the correlation of
/// orientation and translation.
[[nodiscard]] PoseDensity predict_as_in_paper(const PoseDensity& posterior,
                                              const PoseGaussian& T_previous_current, bool odometry_valid,
                                              const MotionSettings& settings, const UnseenSteps& unseen = {});

}  // namespace stereo_slam
