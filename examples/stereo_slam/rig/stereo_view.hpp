// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/pair_geometry.hpp"

namespace stereo_slam {

/// A stereo frame and the geometry that turns its pixels into measurements. Copies are cheap: they share the
/// images.
struct StereoView {
  StereoFrame frame;
  StereoCamera camera;
  PairGeometry geometry;        ///< as estimated before this frame
  bool right_is_usable = true;  ///< false: the right image does not fit the left one

  /// Seen by cameras that are exactly as calibrated.
  [[nodiscard]] static StereoView exact(const StereoFrame& frame, const StereoCamera& camera) {
    return {frame, camera, PairGeometry(camera)};
  }
};

}  // namespace stereo_slam
