// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/constant_velocity.hpp"

#include <limits>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr std::int64_t kStep_ns = 100'000'000;

ConstantVelocity driving() {
  ConstantVelocity velocity;
  velocity.found(0);
  velocity.measured(kStep_ns, test::car_motion());
  return velocity;
}

TEST_CASE("The predicted motion is proportional to the time", "[stereo_slam][velocity]") {
  const ConstantVelocity velocity = driving();
  CHECK(velocity.motion_until(2 * kStep_ns).is_approx(test::car_motion(), 1e-12));
  CHECK(velocity.motion_until(4 * kStep_ns)
            .is_approx(test::car_motion() * test::car_motion() * test::car_motion(), 1e-12));
  CHECK(velocity.unseen_until(4 * kStep_ns).before == 0.0);
  CHECK(velocity.unseen_until(4 * kStep_ns).now == Approx(3.0));
}

TEST_CASE("Unseen steps add up until the motion is measured", "[stereo_slam][velocity]") {
  ConstantVelocity velocity = driving();
  for (int k = 2; k <= 6; ++k) velocity.unmeasured(k * kStep_ns);
  CHECK(velocity.unseen_until(7 * kStep_ns).before == Approx(5.0));
  CHECK(velocity.unseen_until(7 * kStep_ns).now == Approx(1.0));
  CHECK(velocity.motion_until(7 * kStep_ns).is_approx(test::car_motion(), 1e-12));
  velocity.found(7 * kStep_ns);
  CHECK(velocity.unseen_until(8 * kStep_ns).before == 0.0);
}

TEST_CASE("A frame without a measured motion counts as one step, also after a long step",
          "[stereo_slam][velocity]") {
  ConstantVelocity velocity = driving();
  velocity.measured(11 * kStep_ns, test::car_motion());  // ten steps later
  CHECK(velocity.unseen_until(12 * kStep_ns).now == 1.0);
  velocity.unmeasured(12 * kStep_ns);
  CHECK(velocity.unseen_until(13 * kStep_ns).before == 1.0);
  CHECK(velocity.motion_until(13 * kStep_ns).translation().norm() ==
        Approx(0.1 * test::car_motion().translation().norm()).epsilon(0.01));
}

TEST_CASE("The predicted motion is the identity after too many unseen steps", "[stereo_slam][velocity]") {
  ConstantVelocity velocity = driving();
  CHECK(velocity.motion_until(std::numeric_limits<std::int64_t>::max()).coeffs().allFinite());
  for (int k = 2; k <= 80; ++k) velocity.unmeasured(k * kStep_ns);
  CHECK(velocity.motion_until(81 * kStep_ns).is_approx(Pose::identity(), 1e-12));
}

TEST_CASE("The expected motion is as certain as the last ones were constant", "[stereo_slam][velocity]") {
  constexpr double kUsual_m = 0.01;
  ConstantVelocity velocity;
  CHECK_FALSE(velocity.expected_until(0).known());
  CHECK_FALSE(velocity.expected_until(0).surprised_by(test::car_motion()));
  velocity.found(0);
  velocity.measured(kStep_ns, test::car_motion());
  CHECK(velocity.expected_until(2 * kStep_ns).known());
  CHECK_FALSE(velocity.expected_until(2 * kStep_ns).surprised_by(Pose::identity()));  // it has just started
  std::int64_t k = 2;
  for (; k < 40; ++k) velocity.measured(k * kStep_ns, test::car_motion(k % 2 == 0 ? kUsual_m : 0.0));
  const auto steady = velocity.expected_until(k * kStep_ns);
  CHECK(steady.translation_sigma_m > kUsual_m);
  CHECK(steady.translation_sigma_m < 3.0 * kUsual_m);
  CHECK(steady.surprised_by(test::car_motion(-0.5)));
  CHECK(velocity.expected_until((k + 2) * kStep_ns).translation_sigma_m ==
        Approx(3.0 * steady.translation_sigma_m));  // three steps

  // A surprise widens it at once, and ten steady frames narrow it again.
  velocity.measured(k++ * kStep_ns, test::car_motion(-0.5));
  const auto surprised = velocity.expected_until(k * kStep_ns);
  CHECK(surprised.translation_sigma_m > 0.4);
  CHECK_FALSE(surprised.surprised_by(test::car_motion()));
  for (int i = 0; i < 15; ++i) velocity.measured(k++ * kStep_ns, test::car_motion());
  CHECK(velocity.expected_until(k * kStep_ns).surprised_by(test::car_motion(-0.5)));
}

TEST_CASE(
    "Stamps that do not increase count as one step; without a measured motion the prediction is the identity",
    "[stereo_slam][velocity]") {
  const ConstantVelocity velocity = driving();
  CHECK(velocity.motion_until(kStep_ns).is_approx(test::car_motion(), 1e-12));
  CHECK(velocity.motion_until(-kStep_ns).is_approx(test::car_motion(), 1e-12));
  ConstantVelocity standing;
  standing.found(0);
  CHECK(standing.motion_until(kStep_ns).is_approx(Pose::identity(), 1e-12));
  standing.measured(0, test::car_motion());  // the stamps of both frames are equal
  CHECK(standing.motion_until(kStep_ns).is_approx(test::car_motion(), 1e-12));
}

}  // namespace
}  // namespace stereo_slam
