// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/frame_images.hpp"

#include <algorithm>
#include <utility>

namespace stereo_slam {

bool PreviousFrame::repeated_by(const StereoFrame& frame) const {
  const auto same = [](const cv::Mat& a, const cv::Mat& b) {
    if (a.size() != b.size()) return false;
    // Row by row: images that differ mostly differ in their first row.
    for (int row = 0; row < a.rows; ++row) {
      if (!std::equal(a.ptr(row), a.ptr(row) + a.cols, b.ptr(row))) return false;
    }
    return true;
  };
  return !pyramids.left.empty() && same(pyramids.left.image(), frame.left) && same(right, frame.right);
}

void PreviousFrame::replace_images(const StereoFrame& frame, StereoPyramid next) {
  before = std::exchange(pyramids, std::move(next));
  frame.right.copyTo(right);
}

FrameImages prepare_images(const StereoFrame& frame, PyramidSides sides, PreviousFrame& previous) {
  StereoPyramid pyramids = build_pyramids(frame, sides, std::move(previous.before));
  StereoPyramid flow_pyramids =
      previous.pyramids.left.empty() ? pyramids : as_bright_as(previous.pyramids, pyramids, frame);
  return {frame, std::move(pyramids), std::move(flow_pyramids), CornerDetector(frame.left)};
}

}  // namespace stereo_slam
