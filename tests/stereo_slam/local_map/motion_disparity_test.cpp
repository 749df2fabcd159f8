// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/motion_disparity.hpp"

#include <cmath>
#include <random>

#include <antipode/testing/check_jacobian.hpp>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr double kPixelSigma_px = 0.2;

LeftPosition at(const Vector2<double>& px) {
  return {px, kPixelSigma_px * kPixelSigma_px * Matrix2<double>::Identity()};
}

/// A point in view of two cameras, and the motion between them.
struct TwoViews {
  StereoCamera camera = test::kitti_camera();
  PoseGaussian T_first_second{test::car_motion(3.0), Matrix6<double>::Identity() * 1e-12};
  StereoPoint first, second;

  explicit TwoViews(std::mt19937_64& random) {
    for (;;) {
      second = test::random_measurement(random, camera, 8.0, 40.0);
      const auto seen = camera.project(T_first_second.pose * camera.back_project(second));
      // Near the direction of motion there is no parallax.
      if (!seen || (second.head<2>() - Vector2<double>(camera.cx, camera.cy)).norm() < 100.0) continue;
      first = *seen;
      return;
    }
  }

  [[nodiscard]] std::optional<MotionDisparity> disparity(
      const Vector2<double>& first_noise = Vector2<double>::Zero(),
      const Vector2<double>& second_noise = Vector2<double>::Zero()) const {
    return disparity_by_motion(at(first.head<2>() + first_noise), at(second.head<2>() + second_noise),
                               T_first_second, camera);
  }
};

TEST_CASE("The motion of the left camera tells the disparity of a point", "[stereo_slam][landmarks]") {
  std::mt19937_64 random(1);
  for (int i = 0; i < 100; ++i) {
    const TwoViews views(random);
    const auto found = views.disparity();
    REQUIRE(found);
    CAPTURE(views.second.transpose());
    CHECK(found->px == Approx(views.second.z()).epsilon(1e-9));
    CHECK(found->squared_distance < 1e-9);
    CHECK(found->variance_px2 > 0.0);
  }
}

TEST_CASE("A disparity by motion has the derivatives that it reports", "[stereo_slam][landmarks]") {
  std::mt19937_64 random(2);
  for (int i = 0; i < 20; ++i) {
    const TwoViews views(random);
    const auto found = views.disparity();
    REQUIRE(found);
    const auto by_motion = [&](const Vector6<double>& xi) {
      TwoViews moved = views;
      moved.T_first_second.pose = views.T_first_second.pose.boxplus(xi);
      return antipode::Vector<double, 1>(moved.disparity()->px);
    };
    const auto by_positions = [&](const antipode::Vector<double, 4>& shift) {
      return antipode::Vector<double, 1>(views.disparity(shift.head<2>(), shift.tail<2>())->px);
    };
    CHECK(antipode::testing::check_jacobian(by_motion, Vector6<double>(Vector6<double>::Zero()),
                                            found->by_motion, {.tolerance_factor = 100.0}));
    Eigen::Matrix<double, 1, 4> by_both;
    by_both << found->by_first, found->by_second;
    CHECK(antipode::testing::check_jacobian(by_positions,
                                            antipode::Vector<double, 4>(antipode::Vector<double, 4>::Zero()),
                                            by_both, {.tolerance_factor = 100.0}));
  }
}

TEST_CASE("A disparity by motion is as uncertain as it says", "[stereo_slam][landmarks]") {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, kPixelSigma_px);
  double nees = 0.0, distance = 0.0;
  constexpr int kTrials = 2000;
  for (int i = 0; i < kTrials; ++i) {
    const TwoViews views(random);
    const auto found = views.disparity({normal(random), normal(random)}, {normal(random), normal(random)});
    REQUIRE(found);
    nees += std::pow(found->px - views.second.z(), 2) / found->variance_px2 / kTrials;
    distance += found->squared_distance / kTrials;
  }
  // Chi-square, one degree of freedom each: the means have standard deviations of sqrt(2 / kTrials) = .03.
  CHECK(std::abs(nees - 1.0) < 0.1);
  CHECK(std::abs(distance - 1.0) < 0.1);
}

TEST_CASE("Without parallax there is no disparity by motion", "[stereo_slam][landmarks]") {
  const StereoCamera camera = test::kitti_camera();
  const Vector2<double> px(300.0, 200.0);
  CHECK_FALSE(disparity_by_motion(at(px), at(px), PoseGaussian{}, camera));
  Vector6<double> forward = Vector6<double>::Zero();
  forward[5] = 2.0;
  const Vector2<double> ahead(camera.cx, camera.cy);
  const PoseGaussian T{Pose::exp(forward), Matrix6<double>::Identity() * 1e-6};
  CHECK_FALSE(disparity_by_motion(at(ahead), at(ahead), T, camera));
}

TEST_CASE("A point that seems to be behind the cameras has a negative disparity, and one off its line is far",
          "[stereo_slam][landmarks]") {
  std::mt19937_64 random(4);
  const TwoViews views(random);
  const StereoCamera& camera = views.camera;
  // Points move away from the direction of motion. This one moves towards it.
  const Vector2<double> outwards =
      (views.second.head<2>() - Vector2<double>(camera.cx, camera.cy)).normalized();
  Vector6<double> forward = Vector6<double>::Zero();
  forward[5] = 3.0;
  const PoseGaussian T{Pose::exp(forward), Matrix6<double>::Identity() * 1e-8};
  const Vector2<double> px = views.second.head<2>();
  const auto behind = disparity_by_motion(at(px + 5.0 * outwards), at(px), T, camera);
  REQUIRE(behind);
  CHECK(behind->px < 0.0);
  const Vector2<double> sideways(-outwards.y(), outwards.x());
  const auto off = disparity_by_motion(at(px - 5.0 * outwards + 3.0 * sideways), at(px), T, camera);
  REQUIRE(off);
  CHECK(off->squared_distance > 50.0);
}

}  // namespace
}  // namespace stereo_slam
