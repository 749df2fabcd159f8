// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/equal_brightness.hpp"

#include <algorithm>

#include <opencv2/core.hpp>

namespace stereo_slam {
namespace {

struct Brightness {
  double mean = 0.0;      ///< grey levels
  double contrast = 0.0;  ///< standard deviation, grey levels
};

/// Of every eighth row.
[[nodiscard]] Brightness brightness_of(const cv::Mat& image) {
  constexpr int kStep_px = 8;
  if (image.empty()) return {};
  const cv::Mat rows((image.rows + kStep_px - 1) / kStep_px, image.cols, image.type(), image.data,
                     kStep_px * image.step);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(rows, mean, deviation);
  return {mean[0], deviation[0]};
}

[[nodiscard]] bool differ(double a, double b) {
  constexpr double kMostRatio = 1.15;
  return std::max(a, b) > kMostRatio * std::min(a, b);
}

}  // namespace

StereoFrame with_equal_brightness(const StereoFrame& frame) {
  constexpr double kLeast = 5.0;  // grey levels
  const Brightness left = brightness_of(frame.left);
  const Brightness right = brightness_of(frame.right);
  if (std::min({left.mean, left.contrast, right.mean, right.contrast}) < kLeast) return frame;
  if (!differ(left.mean, right.mean) && !differ(left.contrast, right.contrast)) return frame;
  StereoFrame result = frame;
  result.right = cv::Mat();  // not the recorded image's memory
  const double gain = left.contrast / right.contrast;
  frame.right.convertTo(result.right, -1, gain, left.mean - gain * right.mean);
  return result;
}

}  // namespace stereo_slam
