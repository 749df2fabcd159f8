// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/odometry/constant_velocity.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Prior T_keyframe_camera of the current frame from the posterior of the last frame and the odometry (eq.
/// 11). Without a valid odometry, T_previous_current is a guess and the noise grows with the unseen steps.
[[nodiscard]] PoseGaussian predict_pose(const PoseGaussian& posterior, const PoseGaussian& T_previous_current,
                                        bool odometry_valid, const MotionSettings& settings,
                                        const UnseenSteps& unseen = {});

/// The same through 7 x 7 points, as in the paper (eqs. 5-7): its independent model drops the correlation of
/// orientation and translation.
[[nodiscard]] PoseDensity predict_as_in_paper(const PoseDensity& posterior,
                                              const PoseGaussian& T_previous_current, bool odometry_valid,
                                              const MotionSettings& settings, const UnseenSteps& unseen = {});

}  // namespace stereo_slam
