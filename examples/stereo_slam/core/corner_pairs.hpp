// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/descriptor.hpp"

namespace stereo_slam {

/// A corner that was found in both images of a pair.
struct CornerPair {
  cv::Point2f left_px, right_px;
};

/// The ORB features of a grey image, and the image.
struct ImageCorners {
  cv::Mat image;
  std::vector<cv::Point2f> positions_px;
  std::vector<Descriptor> descriptors;
};

[[nodiscard]] ImageCorners find_corners(const cv::Mat& image);

/// Mutually nearest ORB features of two grey images, to sub-pixel accuracy and without assuming
/// rectification. Some pairs are wrong. Takes some ten milliseconds.
[[nodiscard]] std::vector<CornerPair> match_corners(const cv::Mat& left_image, const cv::Mat& right_image);

/// The same of features that were found before. Takes a few milliseconds.
[[nodiscard]] std::vector<CornerPair> match_corners(const ImageCorners& left, const ImageCorners& right);

}  // namespace stereo_slam
