// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "stereo_slam/dataset/rig_file.hpp"

/// The calibrations of other programs, one reader each. A reader gets the file and its contents as YAML,
/// whatever the file is written in, and throws std::runtime_error that names the file and the remedy.
namespace stereo_slam {

/// A calibration file and what it contains: the documents of YAML or JSON; or one that OpenCV's XML, an INI
/// file or ROS's ost.txt were converted to.
struct CalibrationText {
  std::filesystem::path file;
  std::vector<YAML::Node> documents;  ///< at least one

  [[nodiscard]] const YAML::Node& root() const { return documents.front(); }
  /// Whether the only document has this key. A point in it leads into a map: "Camera.fx".
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

}  // namespace stereo_slam
