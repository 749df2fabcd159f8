// SPDX-License-Identifier: MIT
#include "stereo_slam/visualization/view.hpp"

#include <cstdio>
#include <stdexcept>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#ifdef STEREO_SLAM_HAS_HIGHGUI
#include <opencv2/highgui.hpp>
#endif

namespace stereo_slam {

#ifdef STEREO_SLAM_HAS_HIGHGUI

namespace {

constexpr const char* kWindow = "stereo_slam";

/// Whether a window can be opened. A child process tries it, because Qt ends the program when it cannot reach
/// the display.
bool window_opens() {
  const pid_t child = fork();
  if (child == 0) {
    constexpr rlimit kNoCore{0, 0};
    setrlimit(RLIMIT_CORE, &kNoCore);
    if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(1);
    try {
      cv::namedWindow(kWindow);
    } catch (const cv::Exception&) {
      _exit(1);
    }
    _exit(0);
  }
  int status = 1;
  return child > 0 && waitpid(child, &status, 0) == child && status == 0;
}

}  // namespace

Viewer::Viewer() {
  if (!window_opens()) {
    throw std::runtime_error(
        "--view cannot open a window; set DISPLAY to a reachable display, or run without --view");
  }
  cv::namedWindow(kWindow, cv::WINDOW_NORMAL | cv::WINDOW_KEEPRATIO | cv::WINDOW_GUI_NORMAL);
}

void Viewer::show(const cv::Mat& image) {
  if (!sized_) cv::resizeWindow(kWindow, image.size());
  sized_ = true;
  cv::imshow(kWindow, image);
  cv::pollKey();
}

#else

Viewer::Viewer() {
  throw std::runtime_error("--view needs OpenCV's highgui, which this build lacks; run without --view");
}

void Viewer::show(const cv::Mat&) {}

#endif

}  // namespace stereo_slam
