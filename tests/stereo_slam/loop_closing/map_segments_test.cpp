// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/map_segments.hpp"

#include <stdexcept>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("Joined segments have the earliest of them as their root", "[stereo_slam][loops]") {
  MapSegments segments;
  for (const std::size_t first : {0U, 5U, 9U, 20U}) segments.begin(first);
  CHECK(segments.size() == 4);
  CHECK(segments.first_keyframe(2) == 9);
  CHECK(segments.localised(0));
  CHECK_FALSE(segments.localised(3));
  segments.join(3, 1);
  CHECK(segments.joined(1, 3));
  CHECK(segments.root(3) == 1);
  CHECK_FALSE(segments.localised(3));
  segments.join(2, 2);
  CHECK(segments.root(2) == 2);
  segments.join(0, 3);
  CHECK(segments.localised(1));
  CHECK(segments.localised(3));
  CHECK_FALSE(segments.localised(2));
}

TEST_CASE("A segment that does not begin after the one before is refused", "[stereo_slam][loops]") {
  MapSegments segments;
  segments.begin(3);
  CHECK_THROWS_AS(segments.begin(3), std::invalid_argument);
}

}  // namespace
}  // namespace stereo_slam
