// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <ostream>
#include <vector>

#include <Eigen/Geometry>

#include "simulator/world/camera_path.hpp"

/// What an inertial measurement unit (IMU) would read on the path of the camera.
namespace stereo_slam::simulator {

/// The sensor, by default as noisy as that of EuRoC's recordings: densities of its sensor.yaml, and the size
/// of the biases in MH_05's ground truth. Gyroscope in rad/s, accelerometer in m/s^2.
struct ImuSettings {
  double rate_hz = 200.0;
  double gyroscope_noise = 1.7e-4;    ///< density, rad/s/sqrt(Hz)
  double accelerometer_noise = 2e-3;  ///< density, m/s^2/sqrt(Hz)
  double gyroscope_walk = 2e-5;       ///< of the bias, rad/s^2/sqrt(Hz)
  double accelerometer_walk = 3e-3;   ///< of the bias, m/s^3/sqrt(Hz)
  double gyroscope_bias = 0.05;       ///< standard deviation of the bias at the start, rad/s
  double accelerometer_bias = 0.1;    ///< likewise, m/s^2
  double gyroscope_range = std::numeric_limits<double>::infinity();  ///< readings are cut off there, rad/s
  double accelerometer_range = std::numeric_limits<double>::infinity();  ///< likewise, m/s^2
  double delay_s = 0.0;  ///< stamps are later than the time of the reading by this; negative: earlier

  static constexpr double kGravity = 9.81;  ///< m/s^2, along y of the world, which points down
};

/// Throws std::invalid_argument for a number out of range.
void validate(const ImuSettings& settings);

/// One reading, and the biases that it contains.
struct ImuReading {
  double time_s = 0.0;  ///< since the first frame
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();
};

/// The readings from the first frame to the last. `path` has T_world_body of every frame; the body is the
/// IMU. Its motion between the frames is a PathSpline. The same for the same seed.
[[nodiscard]] std::vector<ImuReading> imu_readings(const CameraPath& path, double fps,
                                                   const ImuSettings& settings, std::uint64_t seed);

/// What the ground truth has of a frame besides its pose.
struct ImuTruth {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< of the body, m/s, in the axes of the world
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();
};

/// The truth of every frame of `path`, with the biases of the nearest reading.
[[nodiscard]] std::vector<ImuTruth> imu_truth(const CameraPath& path, double fps,
                                              const std::vector<ImuReading>& readings,
                                              const ImuSettings& settings);

/// data.csv of an IMU in EuRoC's layout. `begin_ns` is the stamp of the first frame.
void write_imu_rows(std::ostream& stream, const std::vector<ImuReading>& readings,
                    const ImuSettings& settings, std::int64_t begin_ns);

/// imu_truth.csv: the truth of every frame, for layouts whose poses have no velocities.
void write_imu_truth(std::ostream& stream, const std::vector<ImuTruth>& truth);

/// sensor.yaml of an IMU in EuRoC's layout; its axes are those of the body.
void write_imu_sensor(std::ostream& stream, const ImuSettings& settings);

}  // namespace stereo_slam::simulator
