// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

namespace stereo_slam {

/// What a PNG's header says.
struct PngHeader {
  int width_px = 0;
  int height_px = 0;
  bool colour = false;
};

/// Checks that a PNG file is whole: signature, chunk lengths, checksums, end mark. Cheap, nothing is decoded.
/// Throws std::runtime_error naming the file and what is wrong (image libraries print such things to stderr
/// instead).
[[nodiscard]] PngHeader check_png(const std::filesystem::path& file);

/// The image as CV_8UC1; colour is converted. Throws std::runtime_error as check_png does.
[[nodiscard]] cv::Mat load_gray_png(const std::filesystem::path& file);

}  // namespace stereo_slam
