// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstddef>
#include <vector>

#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/support/block_drive.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kLoopFrames = test::BlockDrive::kFramesOfOneLap;

struct LoopOutcome {
  std::vector<FrameResult> results;
  std::vector<PoseGaussian> trajectory;
  std::vector<LoopEvent> loops;
};

LoopOutcome drive(bool loop_closure, LoopThread thread) {
  Settings settings;
  settings.loop_closure.enabled = loop_closure;
  const auto& recording = test::block_drive();
  Slam slam(recording.camera, settings, thread);
  LoopOutcome outcome;
  for (std::size_t i = 0; i < kLoopFrames; ++i) outcome.results.push_back(slam.process(recording.frames[i]));
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
  const LoopOutcome open = drive(false, LoopThread::kNone);
  CHECK(open.loops.empty());
  const LoopOutcome closed = drive(true, LoopThread::kNone);
  REQUIRE(closed.loops.size() >= 3);
  const auto& truth = test::block_drive().truth;
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

  for (std::size_t i = 0; i < kLoopFrames; ++i) {
    CAPTURE(i);
    CHECK(closed.results[i].T_odometry_camera.is_approx(open.results[i].T_odometry_camera, 1e-12));
  }

  const LoopOutcome beside = drive(true, LoopThread::kOwn);
  REQUIRE(closed.trajectory.size() == kLoopFrames);
  REQUIRE(beside.trajectory.size() == kLoopFrames);
  for (std::size_t i = 0; i < kLoopFrames; ++i) {
    CAPTURE(i);
    CHECK(beside.trajectory[i].pose.coeffs() == closed.trajectory[i].pose.coeffs());
    CHECK(beside.trajectory[i].covariance == closed.trajectory[i].covariance);
    CHECK(beside.results[i].T_world_camera.pose.coeffs() == closed.results[i].T_world_camera.pose.coeffs());
  }
}

}  // namespace
}  // namespace stereo_slam
