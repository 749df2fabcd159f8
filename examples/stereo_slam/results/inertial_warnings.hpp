// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "stereo_slam/core/inertial_estimate.hpp"

namespace stereo_slam {

/// What the user should know of the IMU after a run: that it was not used and why, and what to correct in the
/// calibration. `known_delay_ns` is the delay that the calibration told.
[[nodiscard]] std::vector<std::string> inertial_warnings(const InertialSummary& imu,
                                                         std::int64_t known_delay_ns);

}  // namespace stereo_slam
