// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/right_camera.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr double kRounding_px = 1e-9;  // of positions of a thousand pixels

TEST_CASE("Measurements follow the displacement of the right image that the landmarks show",
          "[stereo_slam][rig]") {
  RightCamera right(test::kitti_camera(), {});
  const StereoPoint z(400.0, 150.0, 12.0);
  const Vector2<double> left_px = z.head<2>();
  DisplacementEstimate left;
  left.change[0] = 1.0;  // the right image moves to the right: disparities were a pixel too small
  right.take(right.next_image(true), {});
  const Remeasurement change = right.displace(left);
  CHECK(std::abs(change.of(left_px, z).z() - 13.0) < kRounding_px);
  CHECK((change.of(left_px, z).head<2>() - left_px).norm() < kRounding_px);
  const auto now = right.view_of(StereoFrame{}).geometry;
  CHECK((now.right_position(left_px, 13.0) - change.before.right_position(left_px, 12.0)).norm() <
        kRounding_px);
  CHECK(right.next_image(true).displacement.isZero(0.0));  // that of the next frame is unknown
}

TEST_CASE("Of every motion to a keyframe it is known what was learned since", "[stereo_slam][rig]") {
  RightCamera right(test::kitti_camera(), {});
  CHECK(right.consider({}).covariance.isZero(0.0));  // no points: it depends on nothing
  CHECK(right.refine({}, {}).covariance.isZero(0.0));
  const auto changes = right.correct({test::car_motion(), test::car_motion()});
  REQUIRE(changes.size() == 2);
  for (const auto& change : changes) {
    CHECK_FALSE(change.is_corrected);
    CHECK(change.change.isZero(0.0));
  }
  CHECK_THROWS_AS(right.correct(std::vector<Pose>(3)), std::out_of_range);
}

TEST_CASE("A rig that is not learned reports nothing, and stays as calibrated", "[stereo_slam][rig]") {
  RightCamera right(test::kitti_camera(), {.enabled = false});
  right.begin_with_delay({.seconds = 0.01, .sigma_s = 0.001});
  CHECK_FALSE(right.is_late());
  CHECK(right.correct({test::car_motion()}).empty());
  const RigSummary summary = right.summary();
  CHECK_FALSE(summary.lens_error);
  CHECK_FALSE(summary.right_delay);
  CHECK_FALSE(summary.learned);
  CHECK_FALSE(summary.refused_learned);
  CHECK(summary.right_image_displacement_px == 0.0);
  CHECK(right.calibration_error({}).scale_sigma == 0.0);
}

TEST_CASE("A clear error of the disparities at the start is taken, and then not tested again",
          "[stereo_slam][rig]") {
  RightCamera right(test::kitti_camera(), {});
  const SharedDisparityError shown{{2.0, 0.0}, 0.01 * Matrix2<double>::Identity()};
  CHECK(right.tests_disparities(true));
  const auto change = right.test_disparities(shown);
  REQUIRE(change);
  const StereoPoint z(600.0, 180.0, 12.0);  // near the centre; its right image was 2 px too far right
  CHECK(std::abs(change->of(z.head<2>(), z).z() - 14.0) < 0.05);
  CHECK_FALSE(right.tests_disparities(true));
  CHECK(right.tests_disparities(false));  // a frame that is lost after it: its image may be displaced as well
}

TEST_CASE("Motions that do not tell of the disparities change nothing, and are asked ten times",
          "[stereo_slam][rig]") {
  RightCamera right(test::kitti_camera(), {});
  const SharedDisparityError unclear{{2.0, 1.0}, 4.0 * Matrix2<double>::Identity()};
  for (int i = 0; i < 10; ++i) {
    CHECK(right.tests_disparities(true));
    CHECK_FALSE(right.test_disparities(i % 2 == 0 ? std::nullopt : std::optional(unclear)));
  }
  CHECK_FALSE(right.tests_disparities(true));
  CHECK_FALSE(right.tests_disparities(false));
}

constexpr double kDelay_s = 0.05;  // half of the time between two frames

[[nodiscard]] RightCamera late_camera() {
  RightCamera right(test::kitti_camera(), {});
  right.begin_with_delay({.seconds = kDelay_s, .sigma_s = 1e-4});
  return right;
}

[[nodiscard]] RigVelocity velocity_with(double yaw_rad_per_s) {
  RigVelocity velocity{.frame_s = 0.1};
  velocity.per_s << 0.0, yaw_rad_per_s, 0.0, 0.0, 0.0, 9.0;
  return velocity;
}

/// Where the right image of the last frame shows a point, px.
[[nodiscard]] double column(const RightCamera& right, const StereoPoint& z) {
  return right.view_of(StereoFrame{}).geometry.right_position(z).x();
}

TEST_CASE("The exposure of a late keyframe is corrected by the motion after it", "[stereo_slam][rig]") {
  const StereoCamera camera = test::kitti_camera();
  RightCamera right = late_camera();
  (void)right.move_with(velocity_with(0.0));
  const StereoPoint z(600.0, 180.0, 12.0);
  const double straight_px = column(right, z);
  const Remeasurement change = right.expose_with(velocity_with(0.4));
  // It is exposed in the middle of the interval, three quarters of the way from one mean velocity to the
  // next.
  const double turn_px = 0.75 * 0.4 * kDelay_s * camera.fx;
  constexpr double kNotFirstOrder_px = 0.5;  // .4 m ahead and .015 rad
  CHECK(std::abs(column(right, z) - straight_px + turn_px) < kNotFirstOrder_px);
  CHECK((change.before.right_position(z) - change.after.right_position(change.of(z.head<2>(), z))).norm() <
        0.5);  // the same column; rows tell whether it is right
}

TEST_CASE("A turn that a late image shows counts as much as the velocity leaves open", "[stereo_slam][rig]") {
  const StereoPoint z(600.0, 180.0, 12.0);
  for (const double jump_rad_per_s : {0.0, 0.4}) {
    RightCamera right = late_camera();
    (void)right.expose_with(velocity_with(0.0));  // the first keyframe
    right.add_rows({});
    (void)right.move_with(velocity_with(0.0));
    const double expected_px = column(right, z);
    DisplacementEstimate shown;
    shown.change << 3.0, 0.0, 0.0, 3.0, 0.0;  // px, a turn sideways
    shown.covariance *= 0.02 * 0.02;
    (void)right.displace(shown);
    right.add_rows({});
    (void)right.expose_with(velocity_with(jump_rad_per_s));
    const double taken_px = column(right, z) - expected_px;
    CAPTURE(jump_rad_per_s, taken_px);
    if (jump_rad_per_s == 0.0)
      CHECK(taken_px < 2.0);  // neither is known better than to .02 px
    else
      CHECK(std::abs(taken_px - 3.0) < 0.2);  // the velocity tells it to 7 px
  }
}

TEST_CASE("A turn that a late image shows is that of a vibration, if others were unexpected too",
          "[stereo_slam][rig]") {
  const StereoPoint z(600.0, 180.0, 12.0);
  RightCamera right = late_camera();
  (void)right.expose_with(velocity_with(0.0));  // the first keyframe
  right.add_rows({});
  double error_px = 0.0;
  constexpr int kKeyframes = 12, kLearned = 6;
  for (int i = 0; i < kKeyframes; ++i) {
    (void)right.move_with(velocity_with(0.0));
    auto image = right.next_image(true);
    image.late = right.motion_until_exposure(velocity_with(0.0));
    right.take(image, {});
    const double expected_px = column(right, z);
    DisplacementEstimate shown;
    shown.change[0] = shown.change[3] = i % 2 == 0 ? 3.0 : -3.0;  // px, a turn sideways
    shown.covariance *= 0.02 * 0.02;
    (void)right.displace(shown);
    right.add_rows({});
    (void)right.expose_with(velocity_with(0.0));
    if (i >= kLearned)
      error_px = std::max(error_px, std::abs(column(right, z) - expected_px - shown.change[0]));
  }
  CHECK(error_px < 0.05);  // each turn is known to .02 px, relative to the keyframe before
}

TEST_CASE("The displacement of a late right image is a rotation until its exposure", "[stereo_slam][rig]") {
  const RightCamera right = late_camera();
  RightImageState image = right.next_image(true);
  image.late = right.motion_until_exposure(velocity_with(0.0));
  DisplacementEstimate shown;
  shown.change << 2.0, 1.0, 0.5, 2.0, 1.0;
  const RightImageState displaced = right.displaced(image, shown);
  CHECK(displaced.displacement.isZero(0.0));
  REQUIRE(displaced.late);
  const Vector3<double> expected = Vector3<double>(1.0, -2.0, -0.5) / test::kitti_camera().fx;
  CHECK((displaced.late->turn_left_rad - expected).norm() < 1e-12);
  // Once it is taken, nothing but the rotation that is left is open.
  const DisplacementPrior prior = right.displacement_prior(displaced);
  CHECK((prior.mean + shown.change).norm() < 1e-9);
}

TEST_CASE("A knocked right camera is expected where it was knocked to", "[stereo_slam][rig]") {
  RightCamera right(test::kitti_camera(), {});
  DisplacementEstimate shown;
  shown.covariance *= 0.02 * 0.02;
  for (int frame = 0; frame < 30; ++frame) right.take(right.next_image(true), shown);
  CHECK_FALSE(right.is_displaced());
  RightImageState knocked = right.next_image(true);
  knocked.displacement[0] = 1.5;
  right.take(knocked, shown);
  CHECK(right.is_displaced());
  CHECK_FALSE(right.may_be_displaced());
  const RightImageState next = right.next_image(true);
  CHECK(next.displacement == knocked.displacement);
  CHECK(next.covariance(0, 0) == Approx(0.02 * 0.02));
  right.take(next, shown);
  CHECK_FALSE(right.is_displaced());
  CHECK(right.measures_jump());
}

TEST_CASE("A rig that is knocked at its start vibrates", "[stereo_slam][rig]") {
  RightCamera right(test::kitti_camera(), {});
  RightImageState knocked = right.next_image(true);
  knocked.displacement[0] = 1.5;
  right.take(knocked, std::nullopt);
  CHECK(right.may_be_displaced());
  CHECK(right.next_image(true).displacement.isZero(0.0));
}

TEST_CASE("Exposures of synchronous images are exact", "[stereo_slam][rig]") {
  const RightCamera right(test::kitti_camera(), {});
  CHECK(right.exposure_covariance({}).isZero(0.0));
}

TEST_CASE("A rig that is learned hands on what the next run can begin with", "[stereo_slam][rig]") {
  RightCamera right(test::kitti_camera(), {});
  right.begin_with_delay({.seconds = 0.01, .sigma_s = 0.001});
  CHECK(right.is_late());
  CHECK(right.may_be_displaced());
  const RigSummary summary = right.summary();
  REQUIRE(summary.learned);
  CHECK(summary.learned->camera.fx == test::kitti_camera().fx);
  REQUIRE(summary.right_delay);
  CHECK(summary.right_delay->seconds == 0.01);
  RightCamera next(summary.learned->camera, {});
  next.resume(summary.learned->estimate);
  CHECK(next.is_late());
  CHECK_FALSE(next.summary().refused_learned);
}

}  // namespace
}  // namespace stereo_slam
