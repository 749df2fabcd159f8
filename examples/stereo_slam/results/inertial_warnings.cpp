// SPDX-License-Identifier: MIT
#include "stereo_slam/results/inertial_warnings.hpp"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace stereo_slam {
namespace {

/// Whether the calibration has axes of the IMU that are turned by two degrees or more, for certain.
[[nodiscard]] bool is_turned(const InertialSummary& imu) {
  constexpr double kNoticeable_rad = 2.0 * std::numbers::pi / 180.0, kSigmas = 4.0;
  const bool certain = (imu.turn_rad.cwiseAbs().array() > kSigmas * imu.turn_sigma_rad.array()).any();
  return certain && imu.turn_rad.norm() >= kNoticeable_rad;
}

/// Whether the IMU is three centimetres or more from the place that the calibration has, for certain.
[[nodiscard]] bool is_displaced(const InertialSummary& imu) {
  constexpr double kNoticeable_m = 0.03, kSigmas = 4.0;
  const bool certain = (imu.offset_m.cwiseAbs().array() > kSigmas * imu.offset_sigma_m.array()).any();
  return certain && imu.offset_m.norm() >= kNoticeable_m;
}

/// Whether the stamps are late or early by two milliseconds or more, for certain.
[[nodiscard]] bool is_delayed(const InertialSummary& imu) {
  constexpr double kNoticeable_s = 0.002, kSigmas = 4.0;
  return std::abs(imu.delay_s) >= kNoticeable_s && std::abs(imu.delay_s) > kSigmas * imu.delay_sigma_s;
}

[[nodiscard]] std::string delay_text(double delay_s, std::int64_t known_delay_ns) {
  return fmt::format(
      "the stamps of the IMU are about {:.1f} ms {} than those of the images{}, which was corrected while "
      "driving; set timeshift_cam_imu to {:.4f} in the file that describes the IMU",
      1e3 * std::abs(delay_s), delay_s > 0.0 ? "later" : "earlier",
      known_delay_ns == 0 ? "" : " and the known delay",
      delay_s + 1e-9 * static_cast<double>(known_delay_ns));
}

}  // namespace

std::vector<std::string> inertial_warnings(const InertialSummary& imu, std::int64_t known_delay_ns) {
  if (imu.phase == InertialPhase::kOff) {
    return {fmt::format("the IMU contradicts the images and was switched off{}: {}",
                        imu.starts == 0 ? " before it was used" : "", imu.fault)};
  }
  std::vector<std::string> texts;
  if (is_delayed(imu)) {
    texts.push_back(delay_text(imu.delay_s, known_delay_ns));
  } else if (imu.starts == 0) {
    texts.emplace_back(
        "the IMU was not used: in no second were there samples and images enough to find velocity and "
        "gravity");
  }
  if (is_turned(imu)) {
    texts.push_back(
        fmt::format("the axes of the IMU are turned by {:.1f} degrees against the calibration, which was "
                    "corrected while driving; correct T_cam_imu or T_BS",
                    180.0 / std::numbers::pi * imu.turn_rad.norm()));
  }
  if (is_displaced(imu)) {
    const antipode::Vector3<double> offset_mm = 1e3 * imu.offset_m;
    texts.push_back(
        fmt::format("the IMU is {:.0f}, {:.0f}, {:.0f} mm along its axes from where the calibration has it, "
                    "which was corrected while driving; correct T_cam_imu or T_BS",
                    offset_mm.x(), offset_mm.y(), offset_mm.z()));
  }
  return texts;
}

}  // namespace stereo_slam
