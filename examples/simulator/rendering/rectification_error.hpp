// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "simulator/rendering/projection.hpp"
#include "stereo_slam/dataset/stereo_rig.hpp"

namespace stereo_slam::simulator {

/// How far the right camera of a rectified pair is from its calibration.
struct RectificationError {
  double max_displacement_px = 0.0;  ///< of a distant point, largest over the image; >= 0
  std::uint64_t seed = 1;            ///< of the mixture of causes
};

/// A pair of parallel cameras whose right one is rotated, has its principal point elsewhere, and distorts
/// radially. The shares of the three causes are drawn; together they displace some point of the image by
/// `error.max_displacement_px` and none by more.
[[nodiscard]] StereoRig misrectified_rig(const PinholeCamera& camera, double baseline_m,
                                         const RectificationError& error);

}  // namespace stereo_slam::simulator
