// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core/types.hpp>
#include <yaml-cpp/yaml.h>

#include "stereo_slam/calibration/stereo_rig.hpp"
#include "stereo_slam/core/stereo_camera.hpp"

/// Calibrations in YAML. Every function throws std::runtime_error that names file, line and remedy.
namespace stereo_slam {

/// EuRoC: one sensor.yaml per camera, with resolution, intrinsics, distortion_model, distortion_coefficients
/// and T_BS (camera to body). Kalibr's keys (distortion_coeffs, T_cam_imu or T_imu_cam, T_cn_cnm1) are read,
/// too.
[[nodiscard]] StereoRig read_sensor_files(const std::filesystem::path& left,
                                          const std::filesystem::path& right);

/// Kalibr's camchain.yaml, which TUM-VI ships: cam0 and cam1 in one file.
[[nodiscard]] StereoRig read_camchain(const std::filesystem::path& file);
[[nodiscard]] StereoRig read_camchain(const std::filesystem::path& file, const YAML::Node& document);

/// calibration.yaml of a user's own camera, see docs/datasets.md.
struct OwnCamera {
  std::optional<StereoRig> rig;           ///< of raw images; or
  std::vector<StereoRig> other_sizes;     ///< the same cameras at other resolutions, if the file has them
  std::optional<StereoCamera> rectified;  ///< of rectified images; a size of 0 is not known
  std::optional<Eigen::Isometry3d> T_body_camera;  ///< of rectified images; for raw ones the rig contains it
  std::string left_source = "left";                ///< folder, video or camera, relative to the file
  std::string right_source = "right";
  std::optional<std::string> source;  ///< of images side by side, left first, in place of the two above
  std::optional<double> frame_rate_hz;
  std::optional<std::string> times;   ///< file with one time in seconds per frame
  std::vector<std::string> warnings;  ///< what the user should know about the file
};
[[nodiscard]] OwnCamera read_own_camera(const std::filesystem::path& file);

/// The rig for raw images of these sizes: of several resolutions the one of this size, if there is one.
/// Lenses of unknown size get that of the images.
[[nodiscard]] StereoRig rig_for(const OwnCamera& own, const cv::Size& left, const cv::Size& right);

/// Reads `frame_rate_hz` and `times`, which may be added to the calibration of another program.
void read_times(const std::filesystem::path& file, const YAML::Node& document, OwnCamera& own);

/// The usual name of a model: "radtan".
[[nodiscard]] std::string_view to_string(Distortion distortion) noexcept;

}  // namespace stereo_slam
