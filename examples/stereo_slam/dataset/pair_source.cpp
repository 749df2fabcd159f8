// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/pair_source.hpp"

#include <stdexcept>

#include <fmt/format.h>

namespace stereo_slam {

RawPair split(const cv::Mat& side_by_side) {
  const int width = side_by_side.cols / 2;
  if (side_by_side.cols % 2 != 0) {
    throw std::invalid_argument(
        fmt::format("has {} columns, which are not two images side by side", side_by_side.cols));
  }
  return {side_by_side.colRange(0, width).clone(), side_by_side.colRange(width, 2 * width).clone()};
}

}  // namespace stereo_slam
