// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/rectification_estimator.hpp"

namespace stereo_slam {

/// What a run learned of its cameras, from which a run with the same cameras can begin.
struct LearnedCameras {
  StereoCamera camera;  ///< as calibrated
  RectificationEstimate estimate;
};

/// What a run tells of its cameras besides their calibration.
struct RigSummary {
  /// Horizontal displacement of the right image at the principal point, which row offsets cannot reveal; zero
  /// as long as the calibration seems right, px.
  double right_image_displacement_px = 0.0;
  std::optional<LensEstimate>
      lens_error{};  ///< left in the rectified images; nothing where it is not learned
  std::optional<DelayEstimate>
      right_delay{};  ///< of the right images; nothing if none was known at the start
  /// What an earlier run learned, with which this one began, was of other cameras: the images contradict it,
  /// and it was dropped.
  bool refused_learned = false;
  std::optional<LearnedCameras> learned{};  ///< for a later run; nothing where nothing is learned
};

}  // namespace stereo_slam
