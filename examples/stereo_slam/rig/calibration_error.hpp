// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Errors that the calibration may have: what the settings allow, and in proportion to the row offset that
/// was `seen_px` (rms), since errors that no image shows are assumed to be as large as those that images
/// show. `scale_sigma` is what is known of the scale besides.
[[nodiscard]] inline CalibrationError allowed_calibration_error(const CalibrationSettings& allowed,
                                                                const StereoCamera& camera,
                                                                double seen_px = 0.0,
                                                                double scale_sigma = 0.0) {
  const double scale = std::hypot(allowed.scale_sigma, allowed.scale_sigma_per_px * seen_px, scale_sigma);
  const double axes_px =
      std::hypot(allowed.principal_point_sigma_px, allowed.principal_point_per_px * seen_px);
  return {.scale_sigma = std::min(scale, kLargestCalibrationError),
          .axes_sigma_rad = std::min(axes_px / camera.fx, kLargestCalibrationError),
          .common_error_rad = std::min(allowed.common_error_px / camera.fx, kLargestCalibrationError)};
}

}  // namespace stereo_slam
