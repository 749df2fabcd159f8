// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
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

/// By how much the stamps of the samples are later than those of the images, up to 200 ms; nothing unless
/// that leaves less than half of the squared error which the rotations have without a delay.
[[nodiscard]] std::optional<std::int64_t> seen_delay_ns(std::span<const SeenRotation> rotations,
                                                        std::span<const ImuSample> samples);

/// What is probably wrong with the readings of an IMU that contradict the images: other units, axes that are
/// turned, or another clock. Without a rotation to compare with, little can be said. The stamps were later by
/// `known_delay_ns`, which is in the delay that is told.
[[nodiscard]] std::string probable_fault(std::span<const SeenRotation> rotations,
                                         std::span<const ImuSample> samples, std::int64_t known_delay_ns = 0);

}  // namespace stereo_slam
