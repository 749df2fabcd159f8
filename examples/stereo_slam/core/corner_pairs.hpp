// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/descriptor.hpp"
#include "stereo_slam/core/robust_line.hpp"

namespace stereo_slam {

/// A corner that was found in both images of a pair.
struct CornerPair {
  cv::Point2f left_px, right_px;
};

/// The line through the rows of corner pairs, left minus right, over the column in the right image: what a
/// displacement and a roll of the right image do to them; see fit_line().
[[nodiscard]] RobustLine line_of_rows(std::span<const CornerPair> pairs, double least_scale_px);

/// How large an image may be in which corners are looked for as it is. Larger ones are seldom sharp in single
/// pixels, and searching them takes a second.
constexpr double kMostCornerPixels = 3e6;

/// The ORB features of a grey image, and the image, which is reduced if it is larger than wanted.
struct ImageCorners {
  cv::Mat image;
  float unit_px = 1.0F;                   ///< pixels of the given image in one of `image`
  std::vector<cv::Point2f> positions_px;  ///< in `image`
  std::vector<Descriptor> descriptors;
};

[[nodiscard]] ImageCorners find_corners(const cv::Mat& image, double most_pixels = kMostCornerPixels);

/// Mutually nearest ORB features of two grey images, to sub-pixel accuracy and without assuming
/// rectification. Some pairs are wrong. Takes some ten milliseconds.
[[nodiscard]] std::vector<CornerPair> match_corners(const cv::Mat& left_image, const cv::Mat& right_image);

/// The same of features that were found before. Takes a few milliseconds.
[[nodiscard]] std::vector<CornerPair> match_corners(const ImageCorners& left, const ImageCorners& right);

}  // namespace stereo_slam
