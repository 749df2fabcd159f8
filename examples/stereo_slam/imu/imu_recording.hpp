// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/imu/imu_samples_file.hpp"

namespace stereo_slam {

/// The readings of an IMU over a whole recording.
struct ImuRecording {
  std::filesystem::path file;
  ImuSensor sensor;
  std::vector<ImuSample> samples;  ///< stamps increase, in the clock of the frames
  ImuFaults faults;
};

/// The file with the samples of a recording's IMU: imu0/data.csv of EuRoC's layout, or imu.csv in the folder.
/// Nothing if there is none.
[[nodiscard]] std::optional<std::filesystem::path> find_imu(const std::filesystem::path& recording);

/// Reads the samples of an IMU (see read_imu_samples), and the description beside them, if there is one:
/// imu.yaml beside imu.csv, or sensor.yaml, with the keys of EuRoC and Kalibr:
///  - gyroscope_noise_density, gyroscope_random_walk, accelerometer_noise_density,
///    accelerometer_random_walk;
///  - T_BS, the IMU in the body, by default the body itself;
///  - timeshift_cam_imu [s], which added to stamps of the camera gives those of the IMU.
/// `T_body_camera` is the pose of the rectified left camera, by default the body itself. Throws
/// std::runtime_error, which names the file, for one that cannot be read and numbers out of range.
[[nodiscard]] ImuRecording read_imu(const std::filesystem::path& samples,
                                    const std::optional<Eigen::Isometry3d>& T_body_camera);

/// Throws std::runtime_error unless the IMU has samples between these stamps of the first and last frame.
/// Returns a sentence about the frames that have none, if there are more than a second of them.
[[nodiscard]] std::optional<std::string> check_overlap(const ImuRecording& imu, std::int64_t first_ns,
                                                       std::int64_t last_ns);

/// Hands out the samples of a recording frame by frame.
class ImuFeed {
 public:
  /// Refers to the recording.
  explicit ImuFeed(const ImuRecording& imu) : imu_(&imu) {}

  /// The samples since the last call, up to the first one that is a quarter of a second after the stamp: if
  /// the stamps of the IMU are found to be late, these are needed.
  [[nodiscard]] ImuReadings until(std::int64_t stamp_ns);

 private:
  const ImuRecording* imu_;
  std::size_t next_ = 0;
};

}  // namespace stereo_slam
