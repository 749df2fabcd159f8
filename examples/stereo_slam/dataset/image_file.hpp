// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

namespace stereo_slam {

/// What the header of an image says.
struct ImageHeader {
  int width_px = 0;
  int height_px = 0;
  bool colour = false;
};

/// Checks that a PNG file is whole: signature, chunk lengths, checksums, end mark. Cheap, nothing is decoded.
/// Throws std::runtime_error naming the file and what is wrong (image libraries print such things to stderr
/// instead).
[[nodiscard]] ImageHeader check_png(const std::filesystem::path& file);

/// Whether the name ends like that of an image that can be read: png, jpg, jpeg, pgm, bmp, tif, tiff.
[[nodiscard]] bool has_image_name(const std::filesystem::path& file);

/// check_png for any kind of image; all but PNG are decoded for it.
[[nodiscard]] ImageHeader check_image(const std::filesystem::path& file);

/// The image as CV_8UC1; colour is converted, of 16 bits the upper eight are taken. Throws std::runtime_error
/// as check_png does.
[[nodiscard]] cv::Mat load_gray_image(const std::filesystem::path& file);

}  // namespace stereo_slam
