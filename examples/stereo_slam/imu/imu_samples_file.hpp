// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "stereo_slam/imu/imu_samples.hpp"

namespace stereo_slam {

/// Reads rows of `stamp, wx, wy, wz [rad/s], ax, ay, az [m/s^2]`, with more columns or without: the data.csv
/// of EuRoC. Stamps are whole nanoseconds, or seconds with a decimal point. A heading is left out.
///
/// Throws std::runtime_error if the file cannot be read, if more than half of the rows are unreadable, or if
/// fewer than two samples are left.
[[nodiscard]] ImuSamples read_imu_samples(const std::filesystem::path& file);

}  // namespace stereo_slam
