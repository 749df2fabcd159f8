// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/optical_flow.hpp"

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

}  // namespace
}  // namespace stereo_slam
