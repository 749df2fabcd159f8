// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "simulator/rendering/projection.hpp"
#include "stereo_slam/calibration/stereo_rig.hpp"

namespace stereo_slam::simulator {

/// Size of the error with which the right camera of a rectified pair differs from its calibration.
struct RectificationError {
  double max_displacement_px = 0.0;  ///< of distant points, the largest over the right image; >= 0
  std::uint64_t seed = 1;            ///< determines the shares of the causes
};

/// A pair of parallel cameras with errors in the right one: a rotation, an offset of the principal point and
/// radial distortion. The shares of the three causes are drawn at random; together they displace some point
/// of the image by `error.max_displacement_px` and none by more.
[[nodiscard]] StereoRig misrectified_rig(const PinholeCamera& camera, double baseline_m,
                                         const RectificationError& error);

}  // namespace stereo_slam::simulator
