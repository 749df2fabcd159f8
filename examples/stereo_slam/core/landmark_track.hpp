// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// A landmark of the current map as the last frame shows it.
struct LandmarkTrack {
  std::uint32_t id = 0;
  Vector2<double> left_px;  ///< where it was found, or else where it should be
  double depth_m = 0.0;
  int observations = 1;  ///< frames in which it was found
  bool found = false;    ///< in this frame
};

}  // namespace stereo_slam
