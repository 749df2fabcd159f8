// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>

#include <opencv2/core.hpp>

#include "stereo_slam/dataset/image_size.hpp"

namespace stereo_slam {

/// Checks that a PNG file is complete: signature, chunk lengths, checksums and end mark. It is fast: nothing
/// is decoded. Throws std::runtime_error that names the file and the fault; image libraries only print it to
/// stderr.
[[nodiscard]] ImageHeader check_png(const std::filesystem::path& file);

/// Whether the extension is that of a supported image format: png, jpg, jpeg, pgm, bmp, tif, tiff.
[[nodiscard]] bool has_image_name(const std::filesystem::path& file);

/// Like check_png for any image format. Formats other than PNG are decoded.
[[nodiscard]] ImageHeader check_image(const std::filesystem::path& file);

/// used_bits() of an image of 16 bits a pixel; nothing for one of 8 bits. Throws std::runtime_error like
/// check_png.
[[nodiscard]] std::optional<int> bits_of_16(const std::filesystem::path& file);

/// The image as CV_8UC1. Colour is converted to grey; of 16 bits a pixel, the lower `bits` are used, scaled
/// to eight. Throws std::runtime_error like check_png.
[[nodiscard]] cv::Mat load_gray_image(const std::filesystem::path& file, int bits = 16);

}  // namespace stereo_slam
