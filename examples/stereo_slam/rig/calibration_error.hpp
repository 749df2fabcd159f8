// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Errors that the calibration may have: what the settings allow, and in proportion to the row offset that
/// was `seen_px` (rms), since errors that no image shows are assumed to be as large as those that images
/// show. `scale_sigma` is what is known of the scale besides.
[[nodiscard]] CalibrationError allowed_calibration_error(const CalibrationSettings& allowed,
                                                         const StereoCamera& camera, double seen_px = 0.0,
                                                         double scale_sigma = 0.0);

}  // namespace stereo_slam
