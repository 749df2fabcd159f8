// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/orb_descriptors.hpp"

#include "stereo_slam/core/descriptor.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("Descriptors follow the rotation of the image", "[stereo_slam][features]") {
  const cv::Mat image = test::texture_image({201, 201}, {0.0, 0.0});
  cv::Mat turned;
  cv::rotate(image, turned, cv::ROTATE_90_CLOCKWISE);
  const Vector2<double> px(80.0, 120.0);
  const Vector2<double> turned_px(200.0 - px.y(), px.x());
  const auto original = describe_points(image, {px, {3.0, 100.0}});
  const auto rotated = describe_points(turned, {turned_px});
  CHECK(hamming_distance(original[0], rotated[0]) < 30);
  CHECK(hamming_distance(original[0], describe_points(image, {{130.0, 60.0}})[0]) > 60);
  CHECK(original[1] == Descriptor{});  // too near the border
  CHECK(describe_points(image, {}).empty());
}

}  // namespace
}  // namespace stereo_slam
