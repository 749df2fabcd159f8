// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include <opencv2/core.hpp>

#include "stereo_slam/images/grey_image.hpp"
#include "stereo_slam/images/image_size.hpp"

namespace stereo_slam {

/// Whether the extension is that of a supported image format: png, jpg, jpeg, pgm, ppm, pnm, bmp, tif, tiff,
/// webp.
[[nodiscard]] bool has_image_name(const std::filesystem::path& file);

/// Checks that an image file is complete. A PNG is not decoded: signature, chunk lengths, checksums and end
/// mark tell. Throws std::runtime_error that names the file and the fault; image libraries only print it to
/// stderr.
[[nodiscard]] ImageHeader check_image(const std::filesystem::path& file);

/// The image as CV_16UC1 if it has 16 bits a pixel; empty if it has 8. Throws std::runtime_error like
/// check_image.
[[nodiscard]] cv::Mat load_16_bit_image(const std::filesystem::path& file);

/// The image as CV_8UC1. Colour is converted to grey, 16 bits a pixel by the scale. Throws std::runtime_error
/// like check_image.
[[nodiscard]] cv::Mat load_gray_image(const std::filesystem::path& file, const GreyScale& scale = {});

}  // namespace stereo_slam
