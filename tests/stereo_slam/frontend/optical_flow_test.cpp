// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/optical_flow.hpp"

#include <utility>

#include <opencv2/video/tracking.hpp>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

StereoFrame frame_of(cv::Point2d shift, double gain) {
  StereoFrame frame;
  frame.left = test::texture_image({320, 160}, shift, gain);
  frame.right = frame.left.clone();
  return frame;
}

TEST_CASE("Flow survives a jump of the exposure", "[stereo_slam][images]") {
  const double gain = GENERATE(0.4, 0.95, 1.0);
  CAPTURE(gain);
  const auto before = build_pyramids(frame_of({0.0, 0.0}, 1.0));
  const StereoFrame after = frame_of({3.0, -2.0}, gain);
  const auto pyramids = as_bright_as(before, build_pyramids(after), after);
  const std::vector<cv::Point2f> points = {{80.0F, 60.0F}, {160.0F, 80.0F}, {240.0F, 100.0F}};
  const auto flow = track_points(before.left, pyramids.left, points, points, {});
  for (std::size_t i = 0; i < points.size(); ++i) {
    CAPTURE(i);
    CHECK(flow.found[i]);
    CHECK(cv::norm(flow.points[i] - points[i] - cv::Point2f(3.0F, -2.0F)) < 0.2);
  }
}

TEST_CASE("Similar images, dark ones and the first one are not equalised", "[stereo_slam][images]") {
  const StereoFrame frame = frame_of({0.0, 0.0}, 1.0);
  const StereoFrame dark = frame_of({0.0, 0.0}, 0.01);
  const auto pyramids = build_pyramids(frame);
  const auto same = [](const StereoPyramid& a, const StereoPyramid& b) {
    return a.left.image().data == b.left.image().data;
  };
  CHECK(same(as_bright_as({}, pyramids, frame), pyramids));
  CHECK(same(as_bright_as(pyramids, pyramids, frame), pyramids));
  CHECK(same(as_bright_as(build_pyramids(dark), pyramids, frame), pyramids));
  const auto of_dark = build_pyramids(dark);
  CHECK(same(as_bright_as(pyramids, of_dark, dark), of_dark));
}

TEST_CASE("A pyramid is OpenCV's, of any size and in any memory", "[stereo_slam][images]") {
  const auto size =
      GENERATE(cv::Size{16, 300}, cv::Size{42, 43}, cv::Size{43, 44}, cv::Size{101, 67}, cv::Size{320, 161});
  const bool with_derivatives = GENERATE(false, true);
  CAPTURE(size, with_derivatives);
  const cv::Mat image = test::texture_image(size, {});
  std::vector<cv::Mat> expected;
  cv::buildOpticalFlowPyramid(image, expected, {FlowPyramid::kMaxWindow_px, FlowPyramid::kMaxWindow_px},
                              FlowPyramid::kMaxLevel, with_derivatives);
  for (const cv::Size unused_size : {cv::Size{}, size, cv::Size{30, 40}, cv::Size{400, 200}}) {
    FlowPyramid unused;
    if (!unused_size.empty()) unused = FlowPyramid(test::texture_image(unused_size, {7.0, 0.0}));
    const FlowPyramid pyramid(image, with_derivatives, std::move(unused));
    REQUIRE(pyramid.levels().size() == expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      CAPTURE(unused_size, i);
      REQUIRE(pyramid.levels()[i].size() == expected[i].size());
      CHECK(cv::norm(pyramid.levels()[i], expected[i], cv::NORM_INF) == 0.0);
    }
  }
}

}  // namespace
}  // namespace stereo_slam
