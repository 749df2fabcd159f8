// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/dataset/stereo_rig.hpp"

/// Calibrations in YAML. Every function throws std::runtime_error naming file, line and what to do.
namespace stereo_slam {

/// EuRoC: one sensor.yaml a camera, with resolution, intrinsics, distortion_model, distortion_coefficients
/// and T_BS (camera to body). Kalibr's words (distortion_coeffs, T_cam_imu, T_cn_cnm1) mean the same.
[[nodiscard]] StereoRig read_sensor_files(const std::filesystem::path& left,
                                          const std::filesystem::path& right);

/// Kalibr's camchain.yaml, which TUM-VI ships: cam0 and cam1 in one file.
[[nodiscard]] StereoRig read_camchain(const std::filesystem::path& file);

/// calibration.yaml of a user's own camera, see docs/datasets.md.
struct OwnCamera {
  std::optional<StereoRig> rig;           ///< of raw images, or
  std::optional<StereoCamera> rectified;  ///< of images that are rectified already, without image size
  std::optional<Eigen::Isometry3d> T_body_camera;  ///< with rectified images only; else the rig has it
  std::string left_source = "left";                ///< folder or video, relative to the file
  std::string right_source = "right";
  std::optional<double> frame_rate_hz;
  std::optional<std::string> times;  ///< file with one time in seconds a frame
};
[[nodiscard]] OwnCamera read_own_camera(const std::filesystem::path& file);

/// The name people know a model by: "radtan".
[[nodiscard]] std::string_view to_string(Distortion distortion) noexcept;

}  // namespace stereo_slam
