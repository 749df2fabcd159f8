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

/// Equalises the contrast of both images locally (CLAHE), if the settings want it.
void equalise_contrast(StereoFrame& frame, const ImageSettings& settings);

}  // namespace stereo_slam
