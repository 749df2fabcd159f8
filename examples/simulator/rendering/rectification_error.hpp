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

/// Radial distortion that rectification left in the images of both cameras: what an ideal camera sees at the
/// radius r from the principal point, in units of the focal length, is at r (1 + k1 r^2 + k2 r^4). A negative
/// k1 moves the border of the scene towards the centre (barrel).
struct LensError {
  double k1 = 0.0;  ///< [-1, 1]
  double k2 = 0.0;  ///< [-1, 1]
  [[nodiscard]] bool any() const { return k1 != 0.0 || k2 != 0.0; }
};

/// Throws std::invalid_argument unless every pixel of the camera sees one point, without folds.
void validate(const LensError& error, const PinholeCamera& camera);

/// The rig with the error in both lenses, in addition to their radial distortion.
[[nodiscard]] StereoRig with_lens_error(StereoRig rig, const LensError& error);

}  // namespace stereo_slam::simulator
