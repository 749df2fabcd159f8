// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/map_ids.hpp"

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

Keyframe some_keyframe() {
  Keyframe keyframe;
  keyframe.id = 12;
  keyframe.frame = 30;
  keyframe.segment = 1;
  keyframe.points.resize(2);
  keyframe.points[1].landmark = 7;
  return keyframe;
}

TEST_CASE("Without a loaded map a run has the ids of the map", "[stereo_slam][loops]") {
  const MapIds ids;
  const Keyframe keyframe = ids.in_map(some_keyframe());
  CHECK(keyframe.frame == 30);
  CHECK(keyframe.segment == 1);
  CHECK(keyframe.points[1].landmark == 7);
  CHECK(ids.original_frame(keyframe) == 30);
  CHECK_FALSE(ids.is_loaded(0));
}

TEST_CASE("The ids of a run follow those of the loaded map", "[stereo_slam][loops]") {
  const MapIds ids{.keyframes = 10, .segments = 2, .frames = 500, .landmarks = 1000};
  const Keyframe keyframe = ids.in_map(some_keyframe());
  CHECK(keyframe.frame == 530);
  CHECK(keyframe.segment == 3);
  CHECK(keyframe.points[0].landmark == 0);  // none
  CHECK(keyframe.points[1].landmark == 1007);
  CHECK(ids.keyframe_in_map(4) == 14);
  CHECK(ids.is_loaded(9));
  CHECK_FALSE(ids.is_loaded(10));
  CHECK(ids.original_frame(keyframe) == 30);
  Keyframe loaded = some_keyframe();
  loaded.id = 9;
  CHECK(ids.original_frame(loaded) == 30);
}

}  // namespace
}  // namespace stereo_slam
