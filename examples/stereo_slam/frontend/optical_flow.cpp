// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/optical_flow.hpp"

#include <algorithm>
#include <utility>

#include <opencv2/video/tracking.hpp>

#include "stereo_slam/core/parallel.hpp"

namespace stereo_slam {

FlowPyramid::FlowPyramid(const cv::Mat& image, bool with_derivatives, FlowPyramid unused)
    : levels_(std::move(unused.levels_)) {
  cv::buildOpticalFlowPyramid(image, levels_, {kMaxWindow_px, kMaxWindow_px}, kMaxLevel, with_derivatives);
}

StereoPyramid build_pyramids(const StereoFrame& frame, PyramidSides sides, StereoPyramid unused) {
  StereoPyramid pyramids;
  const auto left = [&] {
    pyramids.left = FlowPyramid(frame.left, /*with_derivatives=*/true, std::move(unused.left));
  };
  const auto right = [&] {
    pyramids.right = FlowPyramid(frame.right, /*with_derivatives=*/false, std::move(unused.right));
  };
  if (sides == PyramidSides::kBoth) {
    run_both(left, right);
  } else {
    left();
  }
  return pyramids;
}

StereoPyramid as_bright_as(const StereoPyramid& reference, const StereoPyramid& pyramids,
                           const StereoFrame& frame) {
  constexpr double kDark = 5.0;  // grey levels
  constexpr double kAlike = 1.1;
  if (reference.left.empty()) return pyramids;
  const double wanted = cv::mean(reference.left.image())[0];
  const double given = cv::mean(frame.left)[0];
  if (wanted < kDark || given < kDark || std::max(wanted / given, given / wanted) < kAlike) return pyramids;
  StereoFrame adapted;
  frame.left.convertTo(adapted.left, -1, wanted / given);
  frame.right.convertTo(adapted.right, -1, wanted / given);
  return build_pyramids(adapted, pyramids.right.empty() ? PyramidSides::kLeft : PyramidSides::kBoth);
}

FlowResult track_points(const FlowPyramid& from, const FlowPyramid& to,
                        const std::vector<cv::Point2f>& points, const std::vector<cv::Point2f>& guesses,
                        const FlowOptions& options) {
  FlowResult result;
  if (points.empty()) return result;
  result.points = guesses;
  std::vector<float> error;
  constexpr int kIterations = 20;
  constexpr double kSettled_px = 0.01;
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kIterations, kSettled_px);
  cv::calcOpticalFlowPyrLK(from.levels(), to.levels(), points, result.points, result.found, error,
                           {options.window_px, options.window_px}, options.max_level, criteria,
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  const cv::Size size = to.image().size();
  for (std::size_t i = 0; i < result.points.size(); ++i) {
    const auto& p = result.points[i];
    const bool inside = p.x >= 0.0F && p.y >= 0.0F && p.x < static_cast<float>(size.width) &&
                        p.y < static_cast<float>(size.height);
    if (!inside) result.found[i] = 0;
  }
  return result;
}

}  // namespace stereo_slam
