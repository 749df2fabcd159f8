// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Window with the left image and the projected map points, near ones red, far ones blue.
class Viewer {
 public:
  /// Throws std::runtime_error when there is no display, or OpenCV was built without windows.
  Viewer();

  void show(const StereoFrame& frame, const FrameResult& result, std::span<const MapPoint> map_points,
            const StereoCamera& camera);
};

}  // namespace stereo_slam
