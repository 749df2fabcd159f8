// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

namespace stereo_slam {

/// A window on the screen.
class Viewer {
 public:
  /// Throws std::runtime_error when there is no display, or OpenCV was built without windows.
  Viewer();

  /// Shows an image (CV_8UC3) until the next one.
  void show(const cv::Mat& image);

 private:
  /// Whether the window was given the size of the first image; the user may change it afterwards.
  [[maybe_unused]] bool sized_ = false;
};

}  // namespace stereo_slam
