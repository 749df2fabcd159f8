// SPDX-License-Identifier: MIT
#include <cstddef>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/support/rendered_drive.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("A bend along picket fences and equal windows, or in snow, is driven without an alarm",
          "[stereo_slam][slam]") {
  simulator::SimulationSettings simulation;
  simulation.scenery = GENERATE(simulator::Scenery::kFences, simulator::Scenery::kSnow);
  simulation.frames = 70;
  simulation.camera = {744, 225, 431.3, 431.3, 364.1, 110.9};
  const test::RenderedDrive drive(simulation);
  Slam slam(drive.sequence.camera, {});
  for (std::size_t i = 0; i < drive.sequence.frames.size(); ++i) {
    const FrameResult result = slam.process(load_frame(drive.sequence, i));
    CAPTURE(static_cast<int>(simulation.scenery), i);
    CHECK(result.status == (i == 0 ? TrackingStatus::kInitializing : TrackingStatus::kOk));
    CHECK_FALSE(result.weak.right_camera_turned);
  }
  slam.finish();
  const auto estimate = slam.trajectory();
  const Pose end = to_pose(drive.truth.front().inverse() * drive.truth.back());
  const Pose found = estimate.front().pose.inverse() * estimate.back().pose;
  CHECK((found.translation() - end.translation()).norm() < 0.002 * 45.0);  // of the length of the drive
}

}  // namespace
}  // namespace stereo_slam
