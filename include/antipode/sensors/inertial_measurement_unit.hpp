// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// What an inertial measurement unit (IMU) measures, and its noise.
namespace antipode {

/// What the gyroscope and the accelerometer of an IMU read at one time, in the axes of the IMU, the body.
template <std::floating_point Scalar>
struct ImuSample {
  std::int64_t stamp_ns = 0;                                   ///< time
  Vector3<Scalar> angular_velocity = Vector3<Scalar>::Zero();  ///< rad/s
  Vector3<Scalar> specific_force = Vector3<Scalar>::Zero();  ///< m/s^2: acceleration less gravity. At rest it
                                                             ///< points up and has the length of gravity

  /// Whether all six numbers are finite.
  [[nodiscard]] bool finite() const noexcept {
    return detail::all_finite(angular_velocity) && detail::all_finite(specific_force);
  }
};

/// Noise of an IMU, equal in all three axes. A white noise of density n gives a sample at the rate f [Hz] the
/// standard deviation n sqrt(f), and its integral over T [s] n sqrt(T). The biases are random walks: over T,
/// the density of a walk w makes a bias wander by w sqrt(T). As in the imu.yaml of Kalibr and in EuRoC.
template <std::floating_point Scalar>
struct ImuNoise {
  Scalar gyroscope = 0;                ///< density, rad/s/sqrt(Hz)
  Scalar accelerometer = 0;            ///< density, m/s^2/sqrt(Hz)
  Scalar gyroscope_bias_walk = 0;      ///< rad/s^2/sqrt(Hz)
  Scalar accelerometer_bias_walk = 0;  ///< m/s^3/sqrt(Hz)

  /// Throws unless all four densities are finite and not negative.
  void check() const {
    const Vector4<Scalar> densities(gyroscope, accelerometer, gyroscope_bias_walk, accelerometer_bias_walk);
    if (!(densities.minCoeff() >= Scalar(0)) || !detail::all_finite(densities)) [[unlikely]] {
      detail::throw_invalid("a noise density of an IMU is negative or not finite", densities);
    }
  }
};

}  // namespace antipode
