// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The noise of an IMU in motion, by its own readings: rotors, engines and steps shake it, ten times the
/// noise of the data sheet on a drone (docs/results/inertial.md).
///
/// Second differences a - 2 b + c of three samples contain little motion, and six times the variance of the
/// noise of one sample. The density over half a second and more is twice that which they show, since
/// vibrations are no white noise.
class NoiseInMotion {
 public:
  /// Adds the next sample. Stamps must increase.
  void add(const ImuSample& sample) {
    if (before_ && last_) {
      const double dt = 0.5e-9 * static_cast<double>(sample.stamp_ns - before_->stamp_ns);
      const auto variance = [](const auto& a, const auto& b, const auto& c) {
        return (a - 2.0 * b + c).squaredNorm() / (3.0 * 6.0);
      };
      const Vector2<double> squared_densities(
          dt * variance(before_->angular_velocity, last_->angular_velocity, sample.angular_velocity),
          dt * variance(before_->specific_force, last_->specific_force, sample.specific_force));
      count_ = std::min(count_ + 1.0, kWindow);
      mean_ += (squared_densities - mean_) / count_;
    }
    before_ = last_;
    last_ = sample;
  }

  /// The densities: those at rest, or larger ones.
  [[nodiscard]] ImuNoise densities(const ImuNoise& at_rest) const {
    constexpr double kSlow = 2.0;
    ImuNoise noise = at_rest;
    noise.gyroscope = std::max(noise.gyroscope, kSlow * std::sqrt(mean_.x()));
    noise.accelerometer = std::max(noise.accelerometer, kSlow * std::sqrt(mean_.y()));
    return noise;
  }

 private:
  static constexpr double kWindow = 400.0;  // samples: two seconds

  std::optional<ImuSample> before_, last_;
  Vector2<double> mean_ = Vector2<double>::Zero();  // of the squared densities
  double count_ = 0.0;
};

}  // namespace stereo_slam
