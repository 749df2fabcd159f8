// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/late_exposure.hpp"

#include <cstddef>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "stereo_slam/frontend/plane_warp.hpp"
#include "stereo_slam/rig/exposure_delay.hpp"
#include "stereo_slam/rig/pair_geometry.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// Half a metre ahead, a little sideways and down, in a bend.
Pose motion_between_exposures() {
  Vector6<double> motion;
  motion << 0.004, 0.02, -0.006, 0.03, -0.02, 0.5;
  return Pose::exp(motion);
}

/// Where a camera that has moved sees a point of the left one, by the definition.
Vector2<double> seen_later(const StereoCamera& camera, const Pose& T_left_later, const Vector3<double>& p) {
  const Vector3<double> q = T_left_later.inverse() * p - Vector3<double>(camera.baseline_m, 0.0, 0.0);
  return {camera.fx * q.x() / q.z() + camera.cx, camera.fy * q.y() / q.z() + camera.cy};
}

std::vector<StereoPoint> points_in_view(const StereoCamera& camera) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> u(0.0, 1000.0), v(0.0, camera.height_px), d(4.0, 40.0);
  constexpr std::size_t kPoints = 300;
  std::vector<StereoPoint> points;
  points.reserve(kPoints);
  for (std::size_t i = 0; i < kPoints; ++i) points.emplace_back(u(random), v(random), d(random));
  return points;
}

TEST_CASE("A late right image shows points where the moved camera sees them, and they are measured there",
          "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  const Pose T = motion_between_exposures();
  const LateExposure exposure(camera, T);
  for (const auto& z : points_in_view(camera)) {
    const Vector2<double> left_px = z.head<2>();
    const Vector2<double> right_px = exposure.right_position(left_px, z.z());
    CHECK((right_px - seen_later(camera, T, camera.back_project(z))).norm() < 1e-8);
    const LateExposure::Seen seen = exposure.measure(left_px, right_px);
    CHECK(std::abs(seen.disparity_px - z.z()) < 1e-8);
    CHECK(std::abs(seen.row_error_px) < 1e-8);
    // The derivatives, by differences: errors of 1e-9 / 1e-4 by rounding, and of second order.
    constexpr double kStep = 1e-4;
    const LateExposure::Seen beside = exposure.measure(left_px, right_px - Vector2<double>(kStep, 0.0));
    CHECK(std::abs((beside.disparity_px - z.z()) / kStep - seen.disparity_per_px) < 1e-3);
    const Eigen::Matrix<double, 2, 3> by_step = exposure.by_step(left_px, z.z());
    for (int i = 0; i < 3; ++i) {
      const Pose moved = Pose::from_rotation_translation(
          T.rotation(), Vector3<double>(T.translation() + kStep * Vector3<double>::Unit(i)));
      const LateExposure::Seen changed = LateExposure(camera, moved).measure(left_px, right_px);
      const Vector2<double> change_px(changed.disparity_px - z.z(), changed.row_error_px);
      CHECK((change_px / kStep - by_step.col(i)).norm() < 1e-2 * (1.0 + by_step.norm()));
    }
  }
}

TEST_CASE("A rig that turns further until the late exposure has turned by both rotations",
          "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  const Pose T = motion_between_exposures();
  const Vector3<double> turn(0.003, -0.02, 0.004);
  Vector6<double> further = Vector6<double>::Zero();
  further.head<3>() = turn;
  const LateExposure turned = LateExposure(camera, T).turned(turn);
  const LateExposure expected(camera, T * Pose::exp(further));
  for (const auto& z : points_in_view(camera)) {
    const Vector2<double> left_px = z.head<2>();
    CHECK((turned.right_position(left_px, z.z()) - expected.right_position(left_px, z.z())).norm() < 1e-8);
  }
}

TEST_CASE("A further displacement of a late right image is a turn of the rig, and of another one a shift",
          "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  const PairGeometry at_once(camera);
  const PairGeometry late = at_once.late(motion_between_exposures());
  const Vector3<double> turn(1e-4, -3e-4, 2e-4);  // by which points move .07 to .2 px
  const ImageDisplacement::Coefficients px = ImageDisplacement::by_rotation(camera) * turn;
  CHECK((ImageDisplacement::rotation(px, camera) - turn).norm() < 1e-12);
  // Beside the turn the baseline moves: by .3 mrad of .54 m, seen from 14 m on.
  constexpr double kBaseline_px = 0.02;
  for (const auto& z : points_in_view(camera)) {
    const Vector2<double> right_px = late.right_position(z);
    const Vector2<double> moved_px = ImageDisplacement::basis(right_px, camera) * px;
    CHECK((late.displaced_further(px).right_position(z) - right_px - moved_px).norm() < kBaseline_px);
    CHECK((at_once.displaced(px).displaced_further(px).right_position(z) -
           at_once.displaced(2.0 * px).right_position(z))
              .norm() < 1e-12);
  }
}

TEST_CASE("Without a motion between the exposures a disparity is the difference of the columns",
          "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  const LateExposure standing(camera, Pose::identity());
  const LateExposure at_once;
  const Vector2<double> left_px(700.0, 100.0), right_px(690.0, 100.5);
  CHECK_FALSE(at_once.is_late());
  for (const auto& exposure : {standing, at_once}) {
    const LateExposure::Seen seen = exposure.measure(left_px, right_px);
    CHECK(std::abs(seen.disparity_px - 10.0) < 1e-9);
    CHECK(std::abs(seen.row_error_px + 0.5) < 1e-9);
    CHECK(std::abs(seen.disparity_per_px - 1.0) < 1e-9);
  }
}

TEST_CASE("No disparity is told where the right camera has moved towards the point",
          "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  const LateExposure towards(
      camera, Pose::exp((Vector6<double>() << 0.0, 0.0, 0.0, 0.0, 0.0, 2.0 * camera.baseline_m).finished()));
  const Vector2<double> epipole_px(camera.cx + 0.5 * camera.fx, camera.cy);
  CHECK(towards.measure(epipole_px, epipole_px).disparity_px == 0.0);
}

TEST_CASE("The warp to a late right image follows the surface", "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  const LateExposure exposure(camera, motion_between_exposures());
  constexpr double kStep_px = 1e-3;
  for (const auto& z : points_in_view(camera)) {
    const Vector2<double> slope(0.1, 0.3);
    const Matrix2<double> warp = exposure.warp(z.head<2>(), z.z(), slope);
    for (int i = 0; i < 2; ++i) {
      const Vector2<double> offset = kStep_px * Vector2<double>::Unit(i);
      const auto at = [&](const Vector2<double>& by) {
        return exposure.right_position(z.head<2>() + by, z.z() + slope.dot(by));
      };
      CHECK(((at(offset) - at(-offset)) / (2.0 * kStep_px) - warp.col(i)).norm() < 1e-5);
    }
    const auto back = right_warp({z, slope}, exposure);
    REQUIRE(back);
    CHECK((back->linear * warp - Matrix2<double>::Identity()).norm() < 1e-9);
  }
}

/// Measurements of a rig that moves so, whose right images are `true_s` late, with `geometry` as the run
/// knows it, and a tenth of a pixel of noise in each position of the right image.
std::vector<StereoMeasurement> measured_matches(const PairGeometry& geometry, const LateMotion& motion,
                                                double true_s, std::mt19937_64& random) {
  const StereoCamera camera = test::kitti_camera();
  std::normal_distribution<double> noise_px(0.0, 0.1);
  const PairGeometry exact = PairGeometry(camera).late(motion.in(true_s));
  std::vector<StereoMeasurement> matches;
  for (const auto& z : points_in_view(camera)) {
    Vector2<double> right_px = exact.right_position(z);
    right_px += Vector2<double>(noise_px(random), noise_px(random));
    matches.push_back(geometry.measure(z.head<2>(), right_px));
  }
  return matches;
}

/// Nine metres a second, in a bend.
LateMotion motion_ahead() {
  LateMotion motion;
  motion.turn_rad.y() = 0.004;
  motion.m_per_s.z() = 9.0;
  return motion;
}

TEST_CASE(
    "The rows of moving rigs tell the delay within its standard deviation, beside turns and wrong velocities",
    "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  LateMotion known = motion_ahead();
  known.sigma_m_per_s << 0.05, 0.05, 0.1;
  for (const double true_s : {-0.03, 0.0, 0.005, 0.02, 0.05}) {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    ExposureDelay delay;
    delay.begin_with({.seconds = true_s + 0.004, .sigma_s = 0.004});
    for (int keyframe = 0; keyframe < 10; ++keyframe) {
      const PairGeometry geometry(camera);
      LateMotion motion = known;
      for (int i = 0; i < 3; ++i) motion.m_per_s[i] += known.sigma_m_per_s[i] * normal(random);
      motion.turn_rad.x() += 1e-4 * (keyframe - 5);  // all rows move by up to half a pixel
      delay.add(measured_matches(geometry.late(known.in(delay.used()->seconds)), motion, true_s, random),
                geometry, known, camera);
      delay.advance();
    }
    CAPTURE(true_s, delay.used()->seconds, delay.used()->sigma_s);
    CHECK(std::abs(delay.used()->seconds - true_s) < 3.0 * delay.used()->sigma_s);
    CHECK(delay.used()->sigma_s < 1e-3);
  }
}

TEST_CASE("Without a delay at the start none is estimated, and one that is no number is refused",
          "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  std::mt19937_64 random(6);
  const LateMotion motion = motion_ahead();
  ExposureDelay delay;
  const PairGeometry geometry(camera);
  delay.add(measured_matches(geometry, motion, 0.02, random), geometry, motion, camera);
  delay.advance();
  CHECK_FALSE(delay.used());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(delay.begin_with({nan, 1.0}), std::invalid_argument);
  CHECK_THROWS_AS(delay.begin_with({0.01, 0.0}), std::invalid_argument);
  CHECK_THROWS_AS(delay.begin_with({0.01, nan}), std::invalid_argument);
}

}  // namespace
}  // namespace stereo_slam
