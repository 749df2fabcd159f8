// SPDX-License-Identifier: MIT
#include "stereo_slam/visualization/view.hpp"

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>
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
  cv::namedWindow(kWindow);
}

void Viewer::show(const StereoFrame& frame, const FrameResult& result, std::span<const MapPoint> map_points,
                  const StereoCamera& camera) {
  constexpr double kFar_m = 60.0;
  cv::Mat canvas;
  cv::cvtColor(frame.left, canvas, cv::COLOR_GRAY2BGR);
  const Pose T_camera_world = result.T_world_camera.pose.inverse();
  for (const auto& point : map_points) {
    const Vector3<double> p_camera = T_camera_world * point.position_world;
    const auto z = camera.project(p_camera);
    if (!z || !camera.in_view(*z)) continue;
    const double far = std::clamp(p_camera.z() / kFar_m, 0.0, 1.0);
    cv::circle(canvas, cv::Point2d(z->x(), z->y()), 2, cv::Scalar(255.0 * far, 64.0, 255.0 * (1.0 - far)),
               cv::FILLED);
  }
  cv::putText(canvas,
              fmt::format("{}  {}  {} landmarks", result.index, to_string(result.status), result.landmarks),
              {8, 20}, cv::FONT_HERSHEY_SIMPLEX, 0.5, {0, 255, 255});
  cv::imshow(kWindow, canvas);
  cv::waitKey(1);
}

#else

Viewer::Viewer() {
  throw std::runtime_error("--view needs OpenCV's highgui, which this build lacks; run without --view");
}

void Viewer::show(const StereoFrame&, const FrameResult&, std::span<const MapPoint>, const StereoCamera&) {}

#endif

}  // namespace stereo_slam
