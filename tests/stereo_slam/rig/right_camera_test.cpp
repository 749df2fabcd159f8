// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/right_camera.hpp"

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
  const auto now = right.view_of(StereoFrame{}).rectification;
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
