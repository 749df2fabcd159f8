// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Widths of the borders of images in which all pixels have one value, px.
struct UniformBorders {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;

  /// Whether there is a border on opposite sides, each at least a fiftieth of the image wide: as of images
  /// that were scaled and padded to a size.
  [[nodiscard]] bool pad(int width_px, int height_px) const {
    constexpr int kShare = 50;
    return (kShare * left >= width_px && kShare * right >= width_px) ||
           (kShare * top >= height_px && kShare * bottom >= height_px);
  }
};

/// The borders that both images of every frame have.
[[nodiscard]] UniformBorders uniform_borders(const std::vector<StereoFrame>& frames);

}  // namespace stereo_slam
