// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// A rotation between two frames, as the images show it.
struct SeenRotation {
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
  Vector3<double> angle_rad = Vector3<double>::Zero();  ///< rotation vector, in the axes of the IMU
};

/// What is probably wrong with the readings of an IMU that contradict the images, in plain words: other
/// units, axes that are turned, or another clock. The samples should begin and end a quarter of a second
/// before and after the rotations. Without a rotation to compare with, little can be said.
[[nodiscard]] std::string probable_fault(std::span<const SeenRotation> rotations,
                                         std::span<const ImuSample> samples);

}  // namespace stereo_slam
