// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/images/grey_image.hpp"

/// Images as ROS messages carry them.
namespace stereo_slam {

/// sensor_msgs/Image without its header; `data` belongs to the message.
struct ImageMessage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t step = 0;  ///< bytes a row
  std::string encoding;    ///< "mono8", "bgr8", ...
  bool big_endian = false;
  std::span<const std::uint8_t> data;
};

/// The image as CV_8UC1. Throws std::invalid_argument for encodings other than mono, bgr, rgb, bgra, rgba and
/// bayer_* of 8 and 16 bits, 8UC1, 8UC3, 8UC4, 16UC1, 16UC3 and 16UC4 (which are read as mono, bgr and bgra),
/// yuv422, uyvy, yuv422_yuy2, yuyv, nv12 and nv21, and for sizes that do not fit together. 16 bits a value
/// become 16 bits of grey first, and then 8 by the scale.
[[nodiscard]] cv::Mat to_grey(const ImageMessage& message, const GreyScale& scale = {});

/// An image of 16 bits a value as grey CV_16UC1; empty for another encoding. Throws like to_grey().
[[nodiscard]] cv::Mat values_of_16(const ImageMessage& message);

/// The image of a sensor_msgs/CompressedImage as CV_8UC1: JPEG, PNG or another format that OpenCV decodes.
/// Throws std::invalid_argument for one that is damaged or too large. 16 bits a pixel become grey by the
/// scale.
[[nodiscard]] cv::Mat decode_grey(std::span<const std::uint8_t> compressed, const GreyScale& scale = {});

/// Such an image as CV_16UC1 if it has 16 bits a pixel; empty if it has 8. Throws like decode_grey().
[[nodiscard]] cv::Mat decode_16_bit(std::span<const std::uint8_t> compressed);

}  // namespace stereo_slam
