// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/calibration_error.hpp"

#include <algorithm>
#include <cmath>

#include "stereo_slam/core/pose_estimate.hpp"

namespace stereo_slam {

CalibrationError allowed_calibration_error(const CalibrationSettings& allowed, const StereoCamera& camera,
                                           double seen_px, double scale_sigma) {
  const double scale = std::hypot(allowed.scale_sigma, allowed.scale_sigma_per_px * seen_px, scale_sigma);
  const double axes_px =
      std::hypot(allowed.principal_point_sigma_px, allowed.principal_point_per_px * seen_px);
  return {.scale_sigma = std::min(scale, kLargestCalibrationError),
          .axes_sigma_rad = std::min(axes_px / camera.fx, kLargestCalibrationError),
          .common_error_rad = std::min(allowed.common_error_px / camera.fx, kLargestCalibrationError)};
}

}  // namespace stereo_slam
