// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string_view>

#include "stereo_slam/dataset/sequence.hpp"

namespace stereo_slam {

inline constexpr std::string_view kCalibrationFile = "calibration.yaml";
inline constexpr std::string_view kOwnCameraLayout =
    "calibration.yaml with the folders left and right, or two videos; see docs/datasets.md";

/// Whether this is a file with a YAML extension.
[[nodiscard]] bool is_calibration_file(const std::filesystem::path& file);

/// Reads the images of a user's own camera: a calibration (see docs/datasets.md) and two folders of images or
/// two videos. `format` is folders, video, or auto for what the calibration names.
///
/// Images are paired by name; if no name is common to both folders, by their position in natural order.
/// Stamps come from the file of times, from names that are nanoseconds (13 digits or more), or from the frame
/// rate.
[[nodiscard]] SequenceScan scan_own_camera(const std::filesystem::path& calibration, std::string_view format);

}  // namespace stereo_slam
