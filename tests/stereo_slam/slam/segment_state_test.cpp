// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/segment_state.hpp"

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("The first segment of a run defines the world", "[stereo_slam][slam]") {
  SegmentState state;
  CHECK(state.current() == 0);
  CHECK(state.localised());
  CHECK(state.any_localised());
  CHECK_FALSE(state.take_newly_localised());
}

TEST_CASE("A new segment is localised by the correction that says so, and reports it once",
          "[stereo_slam][slam]") {
  SegmentState state;
  state.begin_next(100, false);
  CHECK(state.current() == 1);
  CHECK_FALSE(state.localised());
  state.correct({true});  // was computed before the segment began
  CHECK_FALSE(state.localised());
  state.correct({true, false});
  CHECK_FALSE(state.localised());
  state.correct({true, true});
  CHECK(state.localised());
  CHECK(state.take_newly_localised());
  CHECK_FALSE(state.take_newly_localised());
  state.correct({true, true});
  CHECK_FALSE(state.take_newly_localised());
}

TEST_CASE("A segment after a short gap has a predicted place, unless that of the one before was unknown",
          "[stereo_slam][slam]") {
  SegmentState state;
  CHECK_FALSE(state.predicted(200));
  state.begin_next(100, true);
  CHECK(state.predicted(200));
  CHECK_FALSE(state.predicted(101));  // what hid the scene may still be in view
  CHECK_FALSE(state.localised());
  state.begin_next(100, true);
  CHECK(state.predicted(200));
  state.begin_next(100, false);
  CHECK_FALSE(state.predicted(200));
  state.begin_next(100, true);
  CHECK_FALSE(state.predicted(200));
  state.correct({true, true, true, true, true});
  state.begin_next(100, true);
  CHECK(state.predicted(200));

  SegmentState loaded = SegmentState::in_loaded_map();
  loaded.begin_next(100, true);
  CHECK_FALSE(loaded.predicted(200));
}

TEST_CASE("In a loaded map nothing is localised until a loop says so, and losses do not undo it",
          "[stereo_slam][slam]") {
  SegmentState state = SegmentState::in_loaded_map();
  CHECK_FALSE(state.localised());
  CHECK_FALSE(state.any_localised());
  state.begin_next(100, false);
  state.correct({false, false});
  CHECK_FALSE(state.any_localised());
  state.correct({true, false});
  CHECK(state.any_localised());
  CHECK_FALSE(state.localised());
  state.begin_next(100, false);
  CHECK(state.any_localised());
}

}  // namespace
}  // namespace stereo_slam
