// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "stereo_slam/calibration/rig_file.hpp"

/// The calibrations of other programs, one reader each. A reader gets the file and its contents as YAML,
/// whatever the file is written in, and throws std::runtime_error that names the file and the remedy.
namespace stereo_slam {

/// A calibration file and what it contains: the documents of YAML or JSON; or one that OpenCV's XML, an INI
/// file or ROS's ost.txt were converted to.
struct CalibrationText {
  std::filesystem::path file;
  std::vector<YAML::Node> documents;  ///< at least one

  [[nodiscard]] const YAML::Node& root() const { return documents.front(); }
  /// Whether the first document has this key. A point in it leads into a map: "Camera.fx".
  [[nodiscard]] bool has(std::string_view key) const;
};

/// Reads a file of any of these kinds, told apart by the beginning of the text.
[[nodiscard]] CalibrationText load_calibration_text(const std::filesystem::path& file);

/// camera_info of ROS: files of camera_calibration, echoed messages, ost.txt. The right camera is in the same
/// file or in one beside it.
[[nodiscard]] OwnCamera read_ros(const CalibrationText& text);

/// cv::stereoCalibrate or cv::fisheye::stereoCalibrate, with M1, D1, M2, D2 (or K1 ...), R and T; R and T may
/// be in extrinsics.yml beside the file.
[[nodiscard]] OwnCamera read_opencv_stereo(const CalibrationText& text);

/// Settings of ORB-SLAM2 and 3: of rectified images (Camera.bf, or Stereo.b), or raw ones (LEFT.K ..., or
/// Camera1.fx ... and Stereo.T_c1_c2, or Camera2.fx ... and Tlr).
[[nodiscard]] OwnCamera read_orb_slam(const CalibrationText& text);

/// Settings of stella_vslam and OpenVSLAM: of rectified images, or with StereoRectifier of raw ones.
[[nodiscard]] OwnCamera read_stella(const CalibrationText& text);

/// SN....conf of a ZED camera, with a rig for each resolution.
[[nodiscard]] OwnCamera read_zed(const CalibrationText& text);

/// Settings of VINS-Fusion, which name the files of both cameras.
[[nodiscard]] OwnCamera read_vins(const CalibrationText& text);

/// Throws: a file of one camera that the settings of VINS name.
[[nodiscard]] OwnCamera read_camodocal_camera(const CalibrationText& text);

/// Settings of OpenVINS, which name a file of Kalibr's kind.
[[nodiscard]] OwnCamera read_open_vins(const CalibrationText& text);

/// calibration.json of Basalt, with kb4, pinhole or pinhole-radtan8 cameras.
[[nodiscard]] OwnCamera read_basalt(const CalibrationText& text);

}  // namespace stereo_slam
