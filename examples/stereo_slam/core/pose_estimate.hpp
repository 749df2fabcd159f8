// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_algebra.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The filter's density of a pose: orientation and translation coupled, valid for wide orientations too.
using PoseDensity = antipode::BinghamGaussian<double>;

/// The estimate if the calibration is wrong by unknown amounts that all frames share. A wrong baseline scales
/// all lengths: the translation is uncertain along itself. A wrong principal point turns the camera's axes by
/// some X: what is estimated is X T X^-1, so that the direction of travel is uncertain. No measurement of the
/// camera tells either, so they are added to what is reported, once for the whole way, and are no part of the
/// state.
[[nodiscard]] PoseGaussian with_calibration_error(const PoseGaussian& T_a_b, const CalibrationError& error);

}  // namespace stereo_slam
