// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/app/duty_cycle.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/slam/slam_system.hpp"
#include "stereo_slam/visualization/view.hpp"
#include "stereo_slam/visualization/view_image.hpp"

namespace stereo_slam {

/// The window of --view. It skips frames so that drawing takes at most three per cent of the time.
class LiveView {
 public:
  /// Throws std::runtime_error when no window can be opened.
  explicit LiveView(const StereoCamera& camera) : camera_(camera) {}

  /// To be called with every frame, after it was processed.
  void show(const StereoFrame& frame, const FrameResult& result, SlamSystem& slam);

 private:
  StereoCamera camera_;
  Viewer viewer_;
  DutyCycle duty_cycle_{0.03};
  std::vector<PathMark> marks_;
  std::vector<LoopEvent> loops_;  ///< those known so far; the SLAM gives none while it looks for more
};

}  // namespace stereo_slam
