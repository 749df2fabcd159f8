// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "stereo_slam/dataset/image_folders.hpp"

namespace stereo_slam {

/// Where the frames were in the recording before images were lost.
struct FramePositions {
  std::vector<std::size_t> of_frame;
  std::size_t count = 0;    ///< of all frames, also the lost ones
  std::size_t missing = 0;  ///< frames of which neither image is there

  /// Positions of so many frames, of which none was lost.
  [[nodiscard]] static FramePositions without_gaps(std::size_t count);
};

/// Positions by the numbers in the names, or in the order of the images if these are no numbers. `frames` are
/// pairs of images of these lists; the right one is empty if its names are others.
[[nodiscard]] FramePositions positions_of(const std::vector<StereoFiles>& frames, const ImageList& left,
                                          const ImageList& right);

}  // namespace stereo_slam
