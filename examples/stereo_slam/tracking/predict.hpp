// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/odometry/constant_velocity.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// The expected motion since the last frame, where none was measured, with the covariance of its noise v_k
/// (eq. 11). In the first such frame it is as certain as the last motions were constant; then it is that of
/// the settings, which grows with the unseen steps.
[[nodiscard]] PoseGaussian guessed_motion(const ExpectedMotion& expected, const MotionSettings& settings,
                                          const UnseenSteps& unseen = {});

/// Prior T_keyframe_camera of the current frame from the posterior of the last frame and the motion since.
[[nodiscard]] PoseGaussian predict_pose(const PoseGaussian& posterior, const PoseGaussian& motion);

/// The same through 7 x 7 points, as in the paper (eqs. 5-7): its independent model drops the correlation of
/// orientation and translation.
[[nodiscard]] PoseDensity predict_as_in_paper(const PoseDensity& posterior, const PoseGaussian& motion);

}  // namespace stereo_slam
