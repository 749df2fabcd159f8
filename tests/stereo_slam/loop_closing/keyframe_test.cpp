// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/keyframe.hpp"

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("Points of a keyframe without landmarks have the landmark id 0", "[stereo_slam][keyframes]") {
  const StereoPoints points = test::points_at({{10.0, 20.0, 3.0}, {11.0, 21.0, 4.0}});
  CHECK(keyframe_points(points, {})[1].landmark == 0);
  CHECK(keyframe_points(points, {7, 9})[1].landmark == 9);
  CHECK(measurement(keyframe_points(points, {})[1]) == StereoPoint(11.0, 21.0, 4.0));
}

}  // namespace
}  // namespace stereo_slam
