// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/motion_model.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr std::int64_t kStep_ns = 100'000'000;
constexpr int kUntilSure = 20;  // frames with one velocity, after which another one is a surprise

Pose ahead(double z_m) { return Pose::exp((Vector6<double>() << 0, 0, 0, 0, 0, z_m).finished()); }

/// A camera that moves ahead; each frame has a hundred points, some of which are followed, and some of these
/// show the motion.
class Drive {
 public:
  Drive() = default;
  /// With one velocity for so long that another one is a surprise.
  explicit Drive(double step_m) {
    for (int i = 0; i < kUntilSure; ++i) move(step_m, 90);
  }

  /// The next frame, `step_m` after the last one.
  void move(double step_m, std::size_t agreeing, std::size_t followed = 100, bool after_loss = false) {
    TrackedPose tracked;
    const Pose next = pose_ * ahead(step_m);
    tracked.odometry = {.valid = agreeing > 0,
                        .T_previous_current = {ahead(step_m), Matrix6<double>::Identity()},
                        .inliers = std::vector<StereoCorrespondence>(agreeing),
                        .right_image = {.in_left = followed, .in_right = followed},
                        .points = 100};
    tracked.update.posterior = {next, Matrix6<double>::Identity()};
    tracked.update.converged = true;
    motion_.learn(tracked, tracked.update.posterior, pose_, after_loss, ++frame_ * kStep_ns);
    pose_ = next;
  }

  /// A frame that nothing measures; its pose is predicted.
  void lose(double step_m) {
    TrackedPose tracked;
    const Pose next = pose_ * ahead(step_m);
    tracked.update.posterior = {next, Matrix6<double>::Identity()};
    motion_.learn(tracked, tracked.update.posterior, pose_, /*after_loss=*/false, ++frame_ * kStep_ns);
    pose_ = next;
  }

  [[nodiscard]] bool in_doubt() const { return motion_.in_doubt(); }

 private:
  MotionModel motion_;
  Pose pose_ = Pose::identity();
  int frame_ = 0;
};

TEST_CASE("A sudden motion that fewer than half of the points show is in doubt until half of them do",
          "[stereo_slam][slam]") {
  Drive drive;
  drive.move(1.0, 30);  // nothing is expected of the first one
  CHECK_FALSE(drive.in_doubt());
  for (int i = 0; i < kUntilSure; ++i) drive.move(1.0, 30);  // traffic, but the motion goes on as it was
  CHECK_FALSE(drive.in_doubt());
  drive.move(0.5, 49);
  CHECK(drive.in_doubt());
  for (int i = 0; i < 40; ++i) {
    drive.move(0.5, 49);
    CHECK(drive.in_doubt());
  }
  drive.move(0.5, 50);
  CHECK_FALSE(drive.in_doubt());
  drive.move(0.5, 30);
  CHECK_FALSE(drive.in_doubt());
}

TEST_CASE("A sudden motion of most points is that of the camera", "[stereo_slam][slam]") {
  Drive drive(1.0);
  drive.move(0.5, 50);
  CHECK_FALSE(drive.in_doubt());
}

TEST_CASE("A sudden motion that all points show but those that are lost is that of the camera",
          "[stereo_slam][slam]") {
  Drive drive(1.0);
  drive.move(0.5, 30, 33);
  CHECK_FALSE(drive.in_doubt());
  for (int i = 0; i < kUntilSure; ++i) drive.move(0.5, 90);
  drive.move(1.0, 30, 34);
  CHECK(drive.in_doubt());
}

TEST_CASE("A sudden motion of landmarks that no point of the odometry shows is in doubt",
          "[stereo_slam][slam]") {
  Drive drive(1.0);
  drive.move(1.02, 0);  // as expected
  CHECK_FALSE(drive.in_doubt());
  drive.move(0.5, 0);
  CHECK(drive.in_doubt());
}

TEST_CASE(
    "After a loss a motion is in doubt if it does not continue the one before, but not after a long one",
    "[stereo_slam][slam]") {
  for (const int lost : {1, 8}) {
    CAPTURE(lost);
    Drive drive(1.0);
    for (int i = 0; i < lost; ++i) drive.lose(1.0);
    CHECK_FALSE(drive.in_doubt());
    drive.move(0.5, 30, 100, /*after_loss=*/true);
    CHECK(drive.in_doubt() == (lost == 1));
  }
}

}  // namespace
}  // namespace stereo_slam
