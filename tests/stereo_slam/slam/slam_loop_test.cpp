// SPDX-License-Identifier: MIT
#include <algorithm>

#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/support/rendered_drive.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// A drive around a block of houses, and again through the street where it began. Rendered once.
const test::RenderedDrive& loop_recording() {
  static const test::RenderedDrive rendered([] {
    simulator::SimulationSettings settings;
    settings.frames = 200;
    settings.fps = 7.0;
    settings.loop.block_length_m = 44.0;
    settings.loop.block_width_m = 36.0;
    settings.camera = {496, 150, 288.0, 288.0, 248.0, 74.0};
    return settings;
  }());
  return rendered;
}

struct Outcome {
  std::vector<FrameResult> results;
  std::vector<PoseGaussian> trajectory;
  std::vector<LoopEvent> loops;
};

Outcome drive(bool loop_closure, LoopThread thread) {
  Settings settings;
  settings.loop_closure.enabled = loop_closure;
  const auto& sequence = loop_recording().sequence;
  Slam slam(sequence.camera, settings, thread);
  Outcome outcome;
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    outcome.results.push_back(slam.process(load_frame(sequence, i)));
  }
  slam.finish();
  outcome.trajectory = slam.trajectory();
  outcome.loops = slam.loop_events();
  return outcome;
}

double distance_m(const Pose& pose, const Eigen::Isometry3d& truth) {
  return (pose.translation() - truth.translation()).norm();
}

TEST_CASE(
    "A rendered loop is found and closed, without a jump in the odometry frame, and with the same bits "
    "from a thread of its own",
    "[stereo_slam][slam][loops]") {
  const Outcome open = drive(false, LoopThread::kNone);
  CHECK(open.loops.empty());
  const Outcome closed = drive(true, LoopThread::kNone);
  REQUIRE(closed.loops.size() >= 3);
  const auto& truth = loop_recording().truth;
  for (const auto& loop : closed.loops) {
    CAPTURE(loop.frame, loop.old_frame, loop.inliers, loop.chi2);
    CHECK(loop.accepted);
    CHECK((truth[loop.frame].translation() - truth[loop.old_frame].translation()).norm() < 20.0);
  }
  CHECK(std::any_of(closed.results.begin(), closed.results.end(), [](auto& r) { return r.loop_corrected; }));

  // At a revisit the loops make the pose more accurate and more certain.
  const std::size_t revisit = closed.loops.back().frame;
  CAPTURE(distance_m(open.trajectory[revisit].pose, truth[revisit]));
  CHECK(distance_m(closed.trajectory[revisit].pose, truth[revisit]) <
        std::max(0.15, distance_m(open.trajectory[revisit].pose, truth[revisit])));
  CHECK(closed.trajectory[revisit].covariance.trace() < open.trajectory[revisit].covariance.trace());

  for (std::size_t i = 0; i < truth.size(); ++i) {
    CAPTURE(i);
    CHECK(closed.results[i].T_odometry_camera.is_approx(open.results[i].T_odometry_camera, 1e-12));
  }

  const Outcome beside = drive(true, LoopThread::kOwn);
  REQUIRE(beside.trajectory.size() == closed.trajectory.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    CAPTURE(i);
    CHECK(beside.trajectory[i].pose.coeffs() == closed.trajectory[i].pose.coeffs());
    CHECK(beside.trajectory[i].covariance == closed.trajectory[i].covariance);
    CHECK(beside.results[i].T_world_camera.pose.coeffs() == closed.results[i].T_world_camera.pose.coeffs());
  }
}

}  // namespace
}  // namespace stereo_slam
