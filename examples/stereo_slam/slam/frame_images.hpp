// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"

namespace stereo_slam {

/// The data of the previous frame that the next frame is tracked from.
struct PreviousFrame {
  StereoPyramid pyramids;
  StereoPyramid before;      ///< pyramids of the frame before, whose memory the next frame reuses
  std::size_t position = 0;  ///< in the trajectory
  bool lost = false;         ///< its pose was only predicted
  std::size_t matches = 0;   ///< landmarks that were found in it

  /// Whether a frame has a bit-identical left image, such as a camera that hangs delivers.
  [[nodiscard]] bool repeated_by(const StereoFrame& frame) const {
    if (pyramids.left.empty()) return false;
    const cv::Mat& left = pyramids.left.image();
    if (left.size() != frame.left.size()) return false;
    // Row by row: images that differ mostly differ in their first row.
    for (int row = 0; row < left.rows; ++row) {
      if (!std::equal(left.ptr(row), left.ptr(row) + left.cols, frame.left.ptr(row))) return false;
    }
    return true;
  }

  /// Whether this is the last of `frames` frames: none was passed over since.
  [[nodiscard]] bool is_last_of(std::size_t frames) const noexcept { return position + 1 == frames; }

  /// Becomes the last of `frames` frames, whose pyramids are `next`.
  void replace(StereoPyramid next, std::size_t frames, bool is_lost) {
    before = std::exchange(pyramids, std::move(next));
    position = frames - 1;
    lost = is_lost;
  }
};

/// A frame with the data that is extracted from its images once and used by all stages. Refers to the frame.
struct FrameImages {
  const StereoFrame& frame;
  StereoPyramid pyramids;
  StereoPyramid flow_pyramids;   ///< of images as bright as the previous ones: for optical flow
  StereoFeatures features = {};  ///< of the whole images, if landmarks are matched by descriptors
};

/// Builds the pyramids of a frame, in the memory of previous.before. `features` stays empty.
[[nodiscard]] inline FrameImages prepare_images(const StereoFrame& frame, PyramidSides sides,
                                                PreviousFrame& previous) {
  StereoPyramid pyramids = build_pyramids(frame, sides, std::move(previous.before));
  StereoPyramid flow_pyramids =
      previous.pyramids.left.empty() ? pyramids : as_bright_as(previous.pyramids, pyramids, frame);
  return {frame, std::move(pyramids), std::move(flow_pyramids)};
}

}  // namespace stereo_slam
