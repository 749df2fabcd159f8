// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/inertial/inertial_state.hpp"

namespace stereo_slam {

/// The motion between two images by the readings of an IMU, with the turn, the biases and the delay of the
/// state. The interval has the stamps of the images, the samples those of the IMU; they should reach as far
/// after the second image as the delay.
[[nodiscard]] ReadMotion read_motion(std::span<const ImuSample> samples, const antipode::TimeInterval& images,
                                     const InertialState& state, const ImuNoise& noise);

}  // namespace stereo_slam
