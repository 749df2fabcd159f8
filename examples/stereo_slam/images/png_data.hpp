// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include <opencv2/core.hpp>

#include "stereo_slam/images/image_size.hpp"

namespace stereo_slam {

/// The header of a PNG image.
struct PngHeader {
  ImageHeader image;
  bool plain_grey = false;  ///< 8 bits, grey without transparency, not interlaced
};

/// Checks that the content of a PNG file is complete: signature, chunk lengths, checksums and end mark.
/// Nothing is decoded. Throws std::runtime_error that names `file` and the fault.
[[nodiscard]] PngHeader check_png_data(const std::filesystem::path& file,
                                       std::span<const std::uint8_t> bytes);

/// The image of a PNG file whose header is plain_grey, as CV_8UC1. Empty if it cannot be decoded this way;
/// other decoders may accept it. Takes 0.6 of the time of libpng, which needs longer to decode most images of
/// a camera than the SLAM to process them.
[[nodiscard]] cv::Mat decode_plain_grey_png(std::span<const std::uint8_t> bytes);

}  // namespace stereo_slam
