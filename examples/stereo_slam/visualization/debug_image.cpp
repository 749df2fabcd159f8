// SPDX-License-Identifier: MIT
#include "stereo_slam/visualization/debug_image.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/visualization/drawing.hpp"

namespace stereo_slam {
namespace {

void draw_arrow(cv::Mat& canvas, const Vector2<double>& from_px, const Vector2<double>& to_px,
                const cv::Scalar& colour) {
  constexpr double kTip_px = 4.0;
  const double length_px = (to_px - from_px).norm();
  if (length_px < 1.0) return;
  cv::arrowedLine(canvas, subpixel(from_px), subpixel(to_px), colour, 1, cv::LINE_AA, kSubpixelBits,
                  std::min(0.5, kTip_px / length_px));
}

void draw_landmark(cv::Mat& canvas, const TracedLandmark& landmark) {
  if (landmark.flow) {
    draw_arrow(canvas, landmark.flow->from_px, landmark.predicted_px, kOrange);
    draw_arrow(canvas, landmark.flow->from_px, landmark.flow->to_px, landmark.static_flow ? kBlue : kRed);
  }
  if (landmark.static_flow) {
    draw_ellipse(canvas, landmark.predicted_px, landmark.search_covariance_px2, kChi2_2_99, kGreen);
  }
  if (landmark.matched_px) draw_dot(canvas, *landmark.matched_px, 1.6, kYellow);
}

[[nodiscard]] std::vector<LegendEntry> legend_of(const FrameResult& result, const AssociationTrace& trace) {
  const auto count = [&](auto&& property) { return std::ranges::count_if(trace.landmarks, property); };
  const auto refused = count([](const auto& landmark) { return landmark.flow && !landmark.static_flow; });
  const auto searched = count([](const auto& landmark) { return landmark.static_flow; });
  const auto matched = count([](const auto& landmark) { return landmark.matched_px.has_value(); });
  return {{fmt::format("frame {}  {}{}", result.index, to_string(result.status),
                       result.is_keyframe ? "  keyframe" : ""),
           kWhite},
          {"predicted flow", kOrange},
          {"observed flow", kBlue},
          {fmt::format("{} refused", refused), kRed},
          {fmt::format("{} searched", searched), kGreen},
          {fmt::format("{} matched", matched), kYellow},
          {fmt::format("{} odometry", trace.odometry_px.size()), kWhite}};
}

}  // namespace

cv::Mat draw_debug_image(const StereoFrame& frame, const FrameResult& result, const AssociationTrace& trace) {
  constexpr double kDimmed = 0.7;  // so that the colours stand out
  cv::Mat canvas;
  cv::cvtColor(frame.left, canvas, cv::COLOR_GRAY2BGR);
  canvas *= kDimmed;
  for (const auto& point_px : trace.odometry_px) draw_dot(canvas, point_px, 1.2, kWhite);
  for (const auto& landmark : trace.landmarks) draw_landmark(canvas, landmark);
  cv::vconcat(canvas, draw_legend(legend_of(result, trace), canvas.cols), canvas);
  return canvas;
}

}  // namespace stereo_slam
