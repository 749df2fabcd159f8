// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace stereo_slam {

/// Whether a position is at least `margin_px` inside an image; false for NaN.
[[nodiscard]] inline bool inside(const cv::Mat& image, double x, double y, double margin_px) {
  return x >= margin_px && y >= margin_px && x < image.cols - 1 - margin_px && y < image.rows - 1 - margin_px;
}

/// Grey value of an 8-bit image between its pixels; the position must be inside.
[[nodiscard]] inline float bilinear(const cv::Mat& image, float x, float y) {
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const float ax = x - static_cast<float>(x0);
  const float ay = y - static_cast<float>(y0);
  const std::uint8_t* upper = image.ptr<std::uint8_t>(y0) + x0;
  const std::uint8_t* lower = upper + image.step;
  const float top = static_cast<float>(upper[0]) + ax * static_cast<float>(upper[1] - upper[0]);
  const float bottom = static_cast<float>(lower[0]) + ax * static_cast<float>(lower[1] - lower[0]);
  return top + ay * (bottom - top);
}

}  // namespace stereo_slam
