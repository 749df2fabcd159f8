// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/imu/imu_description.hpp"
#include "stereo_slam/imu/imu_samples.hpp"

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

/// What the calibration of the cameras says of the IMU.
struct CameraAndImu {
  std::optional<Eigen::Isometry3d> T_body_camera{};  ///< of the rectified left camera; nothing: not known
  std::optional<std::int64_t> later_ns{};  ///< by how much the stamps of the IMU are later, if that is known
};

/// Reads the samples of an IMU (see read_imu_samples), and the description beside them, if there is one.
/// Throws std::runtime_error as read_imu_description and imu_recording do.
[[nodiscard]] ImuRecording read_imu(const std::filesystem::path& samples, const CameraAndImu& camera);

/// The samples of a file with their description, in the clock of the frames. Without one, the body of the
/// calibration is the IMU, and its noise that of a usual sensor. Throws std::runtime_error, which names the
/// file, if the pose of the camera in the axes of the IMU is not known, or if description and calibration
/// have delays that differ.
[[nodiscard]] ImuRecording imu_recording(const std::filesystem::path& file, ImuSamples recorded,
                                         const std::optional<ImuDescription>& description,
                                         const CameraAndImu& camera);

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
