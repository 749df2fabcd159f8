// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/inertial/inertial_state.hpp"

/// A flight whose poses are formulas, and what an IMU and a camera measure of it.
namespace stereo_slam::test {

/// In the world, z up.
struct Flight {
  double shake = 1.0;   ///< factor on the rotations
  double travel = 1.0;  ///< factor on the translations

  [[nodiscard]] Pose T_world_imu(double t) const {
    const Vector3<double> phi(0.3 * std::sin(1.7 * t), 0.25 * std::sin(1.1 * t + 1.0),
                              0.5 * std::sin(0.6 * t));
    const Vector3<double> p(2.0 * std::sin(0.8 * t), 1.5 * std::cos(0.9 * t), 0.5 * std::sin(1.3 * t));
    Vector6<double> rotation = Vector6<double>::Zero();
    rotation.head<3>() = shake * phi;
    return Pose::from_rotation_translation(Pose::exp(rotation).rotation(), Vector3<double>(travel * p));
  }
  [[nodiscard]] Vector3<double> velocity(double t) const {  ///< in the axes of the IMU
    return T_world_imu(t).rotation_matrix().transpose() *
           (T_world_imu(t + kStep).translation() - T_world_imu(t - kStep).translation()) / (2.0 * kStep);
  }
  [[nodiscard]] Vector3<double> gravity(double t) const {
    return T_world_imu(t).rotation_matrix().transpose() * Vector3<double>(0.0, 0.0, -kGravity);
  }
  /// What a perfect IMU reads.
  [[nodiscard]] ImuSample reading(std::int64_t stamp_ns) const {
    const double t = 1e-9 * static_cast<double>(stamp_ns);
    const Pose before = T_world_imu(t - kStep), at = T_world_imu(t), after = T_world_imu(t + kStep);
    const Vector3<double> acceleration =
        (before.translation() - 2.0 * at.translation() + after.translation()) / (kStep * kStep);
    const Vector3<double> force = acceleration + Vector3<double>(0.0, 0.0, kGravity);
    return {stamp_ns, (before.inverse() * after).log().head<3>() / (2.0 * kStep),
            at.rotation_matrix().transpose() * force};
  }

  /// What a perfect IMU reads that is at the point `offset` in these axes.
  [[nodiscard]] ImuSample reading(std::int64_t stamp_ns, const Vector3<double>& offset) const {
    const double t = 1e-9 * static_cast<double>(stamp_ns);
    const auto arm = [&](double at) -> Vector3<double> { return T_world_imu(at).rotation_matrix() * offset; };
    const Vector3<double> acceleration = (arm(t - kStep) - 2.0 * arm(t) + arm(t + kStep)) / (kStep * kStep);
    ImuSample sample = reading(stamp_ns);
    sample.specific_force += T_world_imu(t).rotation_matrix().transpose() * acceleration;
    return sample;
  }

  static constexpr double kStep = 1e-3;  ///< of the differences, s: their errors are below 1e-5 m/s^2
};

constexpr std::int64_t kFrame_ns = 50'000'000, kSample_ns = 5'000'000;

[[nodiscard]] inline Vector3<double> normal3(std::mt19937_64& random, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  Vector3<double> x;
  for (int i = 0; i < 3; ++i) x[i] = normal(random);
  return x;
}

/// A pose with a random error of this covariance.
[[nodiscard]] inline PoseGaussian measured(const Pose& truth, double sigma_rad, double sigma_m,
                                           std::mt19937_64& random) {
  Vector6<double> error, variance;
  error << normal3(random, sigma_rad), normal3(random, sigma_m);
  variance << Vector3<double>::Constant(sigma_rad * sigma_rad), Vector3<double>::Constant(sigma_m * sigma_m);
  return {truth.boxplus(error), variance.asDiagonal()};
}

}  // namespace stereo_slam::test
