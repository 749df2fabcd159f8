// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <antipode/eigen_types.hpp>

namespace stereo_slam {

/// What is done with the readings of an IMU.
enum class InertialPhase {
  kNone,      ///< there are none
  kStarting,  ///< velocity, gravity and biases are being estimated; the images are used alone
  kRunning,   ///< they predict the motion
  kOff,       ///< they contradict the images, and are not used any more
};

/// The name in the result files: "running", say.
[[nodiscard]] constexpr const char* to_string(InertialPhase phase) noexcept {
  switch (phase) {
    case InertialPhase::kNone:
      return "none";
    case InertialPhase::kStarting:
      return "starting";
    case InertialPhase::kRunning:
      return "running";
    case InertialPhase::kOff:
      return "off";
  }
  return "unknown";
}

/// What is known of the motion of the IMU at a frame, besides its pose. All vectors are in the axes of the
/// IMU. Without a running filter the numbers are zero.
struct InertialEstimate {
  InertialPhase phase = InertialPhase::kNone;
  antipode::Vector3<double> velocity = antipode::Vector3<double>::Zero();  ///< of the IMU in the world, m/s
  antipode::Vector3<double> gravity = antipode::Vector3<double>::Zero();   ///< points down, m/s^2
  antipode::Vector6<double> biases = antipode::Vector6<double>::Zero();    ///< rad/s, m/s^2
  /// By how much its stamps are later than those of the images, s, besides what the calibration says.
  double delay_s = 0.0;

  static constexpr int kNumbers = 13;  ///< velocity, gravity, biases, delay
  /// Of these numbers, in this order. That of gravity is zero along it: its length is known.
  antipode::Matrix<double, kNumbers> covariance = antipode::Matrix<double, kNumbers>::Zero();
};

/// How the readings of an IMU were used until now.
struct InertialSummary {
  InertialPhase phase = InertialPhase::kNone;  ///< now
  int starts = 0;                              ///< how often the filter started to run
  int restarts = 0;                            ///< how often it was given up because the images contradicted
  double nis = 0.0;  ///< normalised innovation squared of the motions that the images show, of 6 degrees of
                     ///< freedom: the mean over the last 30
  /// By how much the stamps are later than those of the images, s, besides what the calibration says, and
  /// its standard deviation, as they were found while the filter ran. Zero before.
  double delay_s = 0.0;
  double delay_sigma_s = 0.0;
  /// By which rotation vector, rad, the axes of the readings are turned into those of the calibration, as it
  /// was found while the filter ran, and its standard deviations. Zero before.
  antipode::Vector3<double> turn_rad = antipode::Vector3<double>::Zero();
  antipode::Vector3<double> turn_sigma_rad = antipode::Vector3<double>::Zero();
  /// Where the IMU is relative to the place that the calibration has, m, in its axes, likewise.
  antipode::Vector3<double> offset_m = antipode::Vector3<double>::Zero();
  antipode::Vector3<double> offset_sigma_m = antipode::Vector3<double>::Zero();
  std::string fault{};  ///< for kOff: what is wrong with the readings, probably
};

}  // namespace stereo_slam
