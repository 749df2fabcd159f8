// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include <Eigen/Geometry>

#include "stereo_slam/core/imu_readings.hpp"

namespace stereo_slam {

/// What a file says of an IMU.
struct ImuDescription {
  std::filesystem::path file;
  ImuNoise noise = ImuSensor{}.noise;
  std::optional<Eigen::Isometry3d> T_body_imu{};
  std::optional<std::int64_t> later_ns{};  ///< by how much its stamps are later than those of the cameras
};

/// The file that describes the IMU whose samples are in a file, or is in a folder: the .yaml of the same name
/// or sensor.yaml beside the file; imu.yaml or EuRoC's mav0/imu0/sensor.yaml in the folder. Nothing if there
/// is none.
[[nodiscard]] std::optional<std::filesystem::path> find_imu_description(const std::filesystem::path& place);

/// Reads imu.yaml or sensor.yaml, with the keys of EuRoC and Kalibr:
///  - gyroscope_noise_density, gyroscope_random_walk, accelerometer_noise_density,
///    accelerometer_random_walk;
///  - T_BS, the IMU in the body;
///  - timeshift_cam_imu [s], which added to stamps of the camera gives those of the IMU.
/// Throws std::runtime_error, which names the file and the line, for one that cannot be read and numbers out
/// of range.
[[nodiscard]] ImuDescription read_imu_description(const std::filesystem::path& file);

}  // namespace stereo_slam
