// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/frame_images.hpp"

#include <algorithm>
#include <utility>

namespace stereo_slam {

bool PreviousFrame::repeated_by(const StereoFrame& frame) const {
  if (pyramids.left.empty()) return false;
  const cv::Mat& left = pyramids.left.image();
  if (left.size() != frame.left.size()) return false;
  // Row by row: images that differ mostly differ in their first row.
  for (int row = 0; row < left.rows; ++row) {
    if (!std::equal(left.ptr(row), left.ptr(row) + left.cols, frame.left.ptr(row))) return false;
  }
  return true;
}

FrameImages prepare_images(const StereoFrame& frame, PyramidSides sides, PreviousFrame& previous) {
  StereoPyramid pyramids = build_pyramids(frame, sides, std::move(previous.before));
  StereoPyramid flow_pyramids =
      previous.pyramids.left.empty() ? pyramids : as_bright_as(previous.pyramids, pyramids, frame);
  return {frame, std::move(pyramids), std::move(flow_pyramids), CornerDetector(frame.left)};
}

}  // namespace stereo_slam
