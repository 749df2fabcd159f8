// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_algebra.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The filter's density of a pose: orientation and translation coupled, valid for wide orientations too.
using PoseDensity = antipode::BinghamGaussian<double>;

/// Pose of a keyframe relative to itself: known, up to the smallest covariance that densities represent.
[[nodiscard]] PoseDensity certain_pose();

/// The estimate with the uncertainty of the calibration added. All frames share the calibration's errors, and
/// no measurement of the camera observes them; they are therefore no part of the state, and are added once,
/// to the reported pose. An error of the baseline scales all lengths: the translation is uncertain along
/// itself. An error of the principal point turns the camera's axes by some X: the estimate is X T X^-1
/// instead of T, so that the direction of travel is uncertain.
[[nodiscard]] PoseGaussian with_calibration_error(const PoseGaussian& T_a_b, const CalibrationError& error);

}  // namespace stereo_slam
