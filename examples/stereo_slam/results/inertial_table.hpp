// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>
#include <span>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Writes inertial.csv, one line per frame: the stamp in seconds, what is done with the IMU (InertialPhase),
/// and, while it runs, velocity [m/s], gravity [m/s^2] and the biases of gyroscope [rad/s] and accelerometer
/// [m/s^2], in the axes of the IMU, and the delay [s], then the upper triangle of the 13 x 13 covariance of
/// these numbers, row by row. Otherwise these fields are empty.
void write_inertial(std::ostream& stream, std::span<const FrameResult> results);

}  // namespace stereo_slam
