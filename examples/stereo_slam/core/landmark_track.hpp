// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// A landmark of the local map in the last frame.
struct LandmarkTrack {
  std::uint32_t id = 0;
  Vector2<double> left_px;  ///< in the left image: measured if found, else predicted
  double depth_m = 0.0;     ///< of its mean, along the camera's z axis
  int observations = 1;     ///< frames in which it was found
  bool found = false;       ///< in the last frame
};

}  // namespace stereo_slam
