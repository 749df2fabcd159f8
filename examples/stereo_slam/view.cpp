// SPDX-License-Identifier: MIT
#include "view.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>
#ifdef STEREO_SLAM_HAS_HIGHGUI
#include <opencv2/highgui.hpp>
#endif

namespace stereo_slam {

#ifdef STEREO_SLAM_HAS_HIGHGUI

namespace {
constexpr const char* kWindow = "stereo_slam";
}

Viewer::Viewer() {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) {
    throw std::runtime_error("--view needs a display, but DISPLAY is not set; run without --view");
  }
  try {
    cv::namedWindow(kWindow);
  } catch (const cv::Exception& error) {
    throw std::runtime_error(fmt::format("--view cannot open a window ({}); run without --view", error.err));
  }
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
  throw std::runtime_error("--view needs OpenCV's highgui, absent from this build; run without --view");
}

void Viewer::show(const StereoFrame&, const FrameResult&, std::span<const MapPoint>, const StereoCamera&) {}

#endif

}  // namespace stereo_slam
