// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/settings/settings.hpp"

/// What is done to images between camera and SLAM, besides rectification.
namespace stereo_slam {

/// A copy of the image as CV_8UC1. Colour (BGR, BGRA) is converted to grey; of 16 bits the upper eight are
/// used. Throws std::invalid_argument for another type.
[[nodiscard]] cv::Mat to_grey(const cv::Mat& image);

/// The number of bits that the values of a CV_16UC1 image need, rounded up to an even number, at least eight:
/// 12 if no value is above 4095.
[[nodiscard]] int used_bits(const cv::Mat& image);

/// The lower `bits` of a CV_16UC1 image scaled to CV_8UC1; larger values become white.
[[nodiscard]] cv::Mat bytes_of_bits(const cv::Mat& image, int bits);

/// Equalises the contrast of both images locally (CLAHE), if the settings want it.
void equalise_contrast(StereoFrame& frame, const ImageSettings& settings);

}  // namespace stereo_slam
