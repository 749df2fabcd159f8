// SPDX-License-Identifier: MIT
#include "stereo_slam/io/counted.hpp"

#include "support/catch.hpp"

using stereo_slam::counted;

TEST_CASE("Only one thing is named in the singular", "[stereo_slam][io]") {
  CHECK(counted(0, "frame") == "0 frames");
  CHECK(counted(1, "frame") == "1 frame");
  CHECK(counted(2, "frame") == "2 frames");
  CHECK(counted(1, "pose has", "poses have") == "1 pose has");
  CHECK(counted(3, "pose has", "poses have") == "3 poses have");
}
