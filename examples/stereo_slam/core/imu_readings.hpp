// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/sensors/inertial_measurement_unit.hpp>

/// @file
/// The readings of an inertial measurement unit (IMU) that come with the frames.
namespace stereo_slam {

using ImuSample = antipode::ImuSample<double>;  ///< in the axes of the IMU: rad/s, m/s^2
using ImuNoise = antipode::ImuNoise<double>;    ///< densities

/// Whether a sample can be one of a sensor: finite, and below 100 000 rad/s and m/s^2, whose squares add up.
[[nodiscard]] inline bool is_plausible(const ImuSample& sample) {
  constexpr double kLargest = 1e5;
  const auto within = [](const Eigen::Vector3d& reading) { return reading.cwiseAbs().maxCoeff() < kLargest; };
  return sample.finite() && within(sample.angular_velocity) && within(sample.specific_force);
}

/// The standard deviation of a delay of which nothing is known: images that are stamped on arrival are late
/// by their exposure, readout and transfer, about a period of 50 Hz.
inline constexpr double kUnknownDelaySigma_s = 0.02;
/// That of one from a calibration: stamps of the beginning of the exposure are early by half of it, and it
/// changes by some milliseconds with the light.
inline constexpr double kKnownDelaySigma_s = 0.002;

/// What is known of an IMU beforehand.
struct ImuSensor {
  /// The IMU in the rectified left camera.
  antipode::DualQuaternion<double> T_camera_imu = antipode::DualQuaternion<double>::identity();
  /// Its noise, by default that of a usual sensor at rest. In motion it is larger; the filter measures that.
  ImuNoise noise = {
      .gyroscope = 2e-4, .accelerometer = 2e-3, .gyroscope_bias_walk = 2e-5, .accelerometer_bias_walk = 3e-3};
  /// By how much its stamps were later than those of the frames, which has been taken out of the samples:
  /// messages about a further delay tell the sum.
  std::int64_t known_delay_ns = 0;
  double delay_sigma_s = kUnknownDelaySigma_s;  ///< standard deviation of what is left of the delay
};

/// The samples that come with a frame: those since the frame before, in order, with stamps of the frames'
/// clock. If the last one is not before the frame, readings at the time of the frame are interpolated.
struct ImuReadings {
  ImuSensor sensor;                ///< the same for all frames
  std::vector<ImuSample> samples;  ///< since the frame before
};

}  // namespace stereo_slam
