// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/uniform_borders.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

#include <opencv2/core.hpp>

namespace stereo_slam {
namespace {

/// Whether all pixels have the value of the first one of the image.
bool is_uniform(const cv::Mat& strip, std::uint8_t value) {
  double least = 0.0;
  double most = 0.0;
  cv::minMaxLoc(strip, &least, &most);
  return least == value && most == value;
}

UniformBorders borders_of(const cv::Mat& image) {
  const std::uint8_t value = image.at<std::uint8_t>(0, 0);
  const auto count = [&](int most, const auto& strip) {
    int width = 0;
    while (width < most && is_uniform(strip(width), value)) ++width;
    return width;
  };
  const int columns = image.cols;
  const int rows = image.rows;
  return {.left = count(columns, [&](int i) { return image.col(i); }),
          .top = count(rows, [&](int i) { return image.row(i); }),
          .right = count(columns, [&](int i) { return image.col(columns - 1 - i); }),
          .bottom = count(rows, [&](int i) { return image.row(rows - 1 - i); })};
}

}  // namespace

UniformBorders uniform_borders(const std::vector<StereoFrame>& frames) {
  constexpr int kMost = std::numeric_limits<int>::max();
  if (frames.empty()) return {};
  UniformBorders common{kMost, kMost, kMost, kMost};
  for (const auto& frame : frames) {
    for (const auto* image : {&frame.left, &frame.right}) {
      if (image->empty()) continue;
      const UniformBorders borders = borders_of(*image);
      if (borders.left == image->cols) continue;  // black, say
      common.left = std::min(common.left, borders.left);
      common.top = std::min(common.top, borders.top);
      common.right = std::min(common.right, borders.right);
      common.bottom = std::min(common.bottom, borders.bottom);
    }
  }
  return common.left == kMost ? UniformBorders{} : common;
}

}  // namespace stereo_slam
