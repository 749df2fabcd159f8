// SPDX-License-Identifier: MIT
#include "stereo_slam/visualization/view_image.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/visualization/drawing.hpp"

namespace stereo_slam {
namespace {

constexpr double kNearest_baselines = 5.0;
constexpr double kFarthest_baselines = 100.0;

/// Colours from near to far.
[[nodiscard]] const cv::Mat& palette() {
  static const cv::Mat colours = [] {
    cv::Mat ramp(1, 256, CV_8UC1);
    for (int i = 0; i < 256; ++i)
      ramp.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(235 - i * 215 / 255);
    cv::Mat result;
    cv::applyColorMap(ramp, result, cv::COLORMAP_TURBO);
    return result;
  }();
  return colours;
}

void draw_track(cv::Mat& canvas, const LandmarkTrack& track, double scale, double baseline_m) {
  const double radius_px = std::min(6.0, 1.5 + 0.8 * std::log2(std::max(1, track.observations)));
  const cv::Scalar colour = depth_colour(track.depth_m, baseline_m);
  const Vector2<double> at_px = scale * track.left_px;
  if (track.found) return draw_dot(canvas, at_px, radius_px, colour);
  cv::circle(canvas, subpixel(at_px), static_cast<int>(radius_px * (1 << kSubpixelBits)), colour, 1,
             cv::LINE_8, kSubpixelBits);
}

/// The palette with depths in metres.
[[nodiscard]] cv::Mat draw_depth_scale(int width_px, double baseline_m) {
  constexpr int kHeight_px = 24;
  cv::Mat line(kHeight_px, width_px, CV_8UC3, kBackground);
  const cv::Rect bar(width_px / 4, 7, std::max(1, width_px / 2), 10);
  cv::resize(palette(), line(bar), bar.size(), 0.0, 0.0, cv::INTER_NEAREST);
  const std::string near = fmt::format("{:.2g} m", kNearest_baselines * baseline_m);
  const int text_px = cv::getTextSize(near, cv::FONT_HERSHEY_SIMPLEX, 0.4, 1, nullptr).width;
  cv::putText(line, near, {bar.x - text_px - 8, 17}, cv::FONT_HERSHEY_SIMPLEX, 0.4, kWhite, 1, cv::LINE_AA);
  cv::putText(line, fmt::format("{:.3g} m and farther", kFarthest_baselines * baseline_m),
              {bar.x + bar.width + 8, 17}, cv::FONT_HERSHEY_SIMPLEX, 0.4, kWhite, 1, cv::LINE_AA);
  return line;
}

[[nodiscard]] std::vector<LegendEntry> legend_of(const ViewScene& scene) {
  const auto found = std::ranges::count_if(scene.tracks, [](auto& t) { return t.found; });
  const auto& P = scene.result.T_world_camera.covariance;
  const double sigma_deg = std::sqrt(P.topLeftCorner<3, 3>().trace() / 3.0) * 180.0 / std::numbers::pi;
  const double sigma_m = std::sqrt(P.bottomRightCorner<3, 3>().trace() / 3.0);
  return {{fmt::format("frame {}", scene.result.index), kWhite},
          {to_string(scene.result.status), colour_of(scene.result.status)},
          {fmt::format("{} of {} landmarks found (larger: for longer)", found, scene.tracks.size()), kWhite},
          {fmt::format("sigma {:.3f} m, {:.3f} deg", sigma_m, sigma_deg), kYellow}};
}

}  // namespace

cv::Scalar depth_colour(double depth_m, double baseline_m) {
  const double nearest_m = kNearest_baselines * baseline_m;
  const double share =
      std::log(std::max(depth_m, nearest_m) / nearest_m) / std::log(kFarthest_baselines / kNearest_baselines);
  const auto colour = palette().at<cv::Vec3b>(0, static_cast<int>(std::lround(255.0 * std::min(1.0, share))));
  return {static_cast<double>(colour[0]), static_cast<double>(colour[1]), static_cast<double>(colour[2])};
}

cv::Mat draw_view(const ViewScene& scene) {
  constexpr double kNarrowest_px = 900.0;
  constexpr double kWidest_px = 1280.0;
  constexpr int kLeastHeight_px = 440;
  const cv::Mat& left = scene.frame.left;
  const double scale = std::clamp(1.0, kNarrowest_px / left.cols, kWidest_px / left.cols);
  cv::Mat image;
  cv::cvtColor(left, image, cv::COLOR_GRAY2BGR);
  if (scale != 1.0) {
    cv::resize(image, image, {}, scale, scale, scale < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
  }
  for (const auto& track : scene.tracks) draw_track(image, track, scale, scene.camera.baseline_m);

  const int width_px = image.cols;
  cv::vconcat(std::vector<cv::Mat>{image, draw_legend(legend_of(scene), width_px),
                                   draw_depth_scale(width_px, scene.camera.baseline_m)},
              image);
  const int missing_px = std::max(0, kLeastHeight_px - image.rows);
  cv::copyMakeBorder(image, image, missing_px / 2, missing_px - missing_px / 2, 0, 0, cv::BORDER_CONSTANT,
                     kBackground);
  cv::Mat view;
  cv::hconcat(image, draw_top_view(scene, image.rows), view);
  return view;
}

}  // namespace stereo_slam
