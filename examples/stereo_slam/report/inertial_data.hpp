// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam::report {

/// What an IMU told of the frames `rows`, as the page shows it, in the axes of the IMU: velocity in m/s, the
/// angle of each axis above the horizon in degrees, the biases in degrees/s and m/s^2, and the delay in ms;
/// each with its standard deviations. Arrays have three numbers a frame, for the delay one, null while the
/// filter does not run. Null if it never ran.
[[nodiscard]] nlohmann::json inertial_data(std::span<const FrameResult> results,
                                           const std::vector<std::size_t>& rows);

}  // namespace stereo_slam::report
