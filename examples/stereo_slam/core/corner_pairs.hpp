// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace stereo_slam {

/// A corner that was found in both images of a pair.
struct CornerPair {
  cv::Point2f left_px, right_px;
};

/// Mutually nearest ORB features of two grey images, to sub-pixel accuracy and without assuming
/// rectification. Some pairs are wrong. Takes some ten milliseconds.
[[nodiscard]] std::vector<CornerPair> match_corners(const cv::Mat& left_image, const cv::Mat& right_image);

}  // namespace stereo_slam
