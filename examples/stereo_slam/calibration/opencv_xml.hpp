// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include <yaml-cpp/yaml.h>

namespace stereo_slam {

/// Reads an XML file that cv::FileStorage wrote, as if it were YAML: elements are maps, elements called `_`
/// are lists, and text is a value, or a list if it has several. OpenCV's own parser crashes on some damaged
/// files. Throws std::runtime_error that names the file if it is damaged.
[[nodiscard]] YAML::Node load_opencv_xml(const std::filesystem::path& file);

}  // namespace stereo_slam
