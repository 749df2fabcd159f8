// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "simulator/recording/imu.hpp"
#include "simulator/recording/simulate.hpp"
#include "simulator/world/camera_path.hpp"

namespace stereo_slam::simulator {

/// Creates a folder; throws std::runtime_error when that is impossible, or when it exists and is not empty.
void make_empty_folder(const std::filesystem::path& output);

/// The folder of a recording, in KITTI's layout or, with a rig, in EuRoC's. All functions throw
/// std::runtime_error with the path where a file cannot be written.
class RecordingFolder {
 public:
  /// Creates the folders; throws std::runtime_error when `output` is not empty, so that nothing is
  /// overwritten and no recording is mixed with another. `settings` must outlive this object.
  RecordingFolder(const SimulationSettings& settings, const std::filesystem::path& output);

  void write_cameras() const;
  /// With an IMU also its readings, and velocities and biases in the ground truth.
  void write_times_and_poses(const CameraPath& path) const;
  /// disturbance.csv: what happens to the right camera in each frame.
  void write_disturbance(const std::vector<RightCameraError>& errors, const PinholeCamera& camera) const;
  /// `side` is 0 for the left camera, 1 for the right one.
  void write_image(const cv::Mat1b& image, std::size_t side, std::size_t frame) const;
  /// The mask of the moving objects in the left image.
  void write_mask(const cv::Mat1b& mask, std::size_t frame) const;

 private:
  [[nodiscard]] std::string name(std::size_t frame) const;
  /// Returns the truth of every frame; none without an IMU.
  std::vector<ImuTruth> write_imu(const CameraPath& body_path) const;

  const SimulationSettings& settings_;
  std::filesystem::path root_;
  std::array<std::filesystem::path, 2> images_;
};

}  // namespace stereo_slam::simulator
