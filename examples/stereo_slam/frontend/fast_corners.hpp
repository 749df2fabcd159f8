// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace stereo_slam {

/// The part of an image where corners may be: kDescriptorReach_px away from its border, so that they can be
/// described. Empty for a small image.
[[nodiscard]] cv::Rect corner_area(cv::Size image);

/// The FAST corners of a part of a grey image, row by row, without those that are next to a stronger one.
/// `part` lies within corner_area(). `threshold` is a difference of grey levels.
[[nodiscard]] std::vector<cv::KeyPoint> fast_corners(const cv::Mat& image, const cv::Rect& part,
                                                     int threshold);

/// Strength of a corner (Shi and Tomasi 1994): the smaller eigenvalue of the structure tensor, summed over
/// 7 x 7 pixels around `centre`, grey levels^2. `centre` is at least five pixels from the border.
[[nodiscard]] double smallest_eigenvalue(const cv::Mat& image, cv::Point centre);

}  // namespace stereo_slam
