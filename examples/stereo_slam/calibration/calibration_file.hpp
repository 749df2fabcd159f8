// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "stereo_slam/calibration/rig_file.hpp"

namespace stereo_slam {

/// The calibration of a stereo camera, from a file of any of these kinds, told apart by their contents:
///  - calibration.yaml of docs/datasets.md;
///  - Kalibr's camchain.yaml;
///  - the results of cv::stereoCalibrate as OpenCV's FileStorage writes them, in YAML or XML: M1, D1, M2, D2
///    (or K1 ...), R and T; R and T may be in extrinsics.yml beside the file;
///  - ROS camera_info as left.yaml, with right.yaml beside it, or the folder of both.
/// If the file does not give the image size, the lenses have width 0. Throws std::runtime_error that names
/// file and remedy.
[[nodiscard]] OwnCamera read_calibration(const std::filesystem::path& file);

}  // namespace stereo_slam
