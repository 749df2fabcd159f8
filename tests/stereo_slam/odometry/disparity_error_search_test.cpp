// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/disparity_error_search.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/LU>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr double kPointNoise_px = 0.15;

/// Points of the previous frame and their positions in the left image of the current one.
struct MovedScene {
  std::vector<StereoPoint> previous;
  std::vector<Vector2<double>> current_px;

  [[nodiscard]] std::optional<SharedDisparityError> error() const {
    return find_shared_disparity_error(previous, current_px, test::kitti_camera(), kPointNoise_px);
  }
};

/// A scene whose right image was displaced by a + d x^2 in the previous frame. One in `outlier_every` moves
/// by itself.
MovedScene moved_scene(std::mt19937_64& random, const Pose& T_previous_current,
                       const Vector2<double>& displacement_px, int outlier_every = 0) {
  const StereoCamera camera = test::kitti_camera();
  std::normal_distribution<double> noise_px(0.0, kPointNoise_px);
  MovedScene scene;
  for (int i = 0; i < 120; ++i) {
    StereoPoint z = test::random_measurement(random, camera, 3.0, 60.0);
    const auto now = camera.project(T_previous_current.inverse() * camera.back_project(z));
    if (!now) continue;
    const double x = (z.x() - z.z() - camera.cx) / camera.fx;
    z.z() += noise_px(random) - displacement_px.x() - displacement_px.y() * x * x;
    if (!(z.z() > 0.0)) continue;
    scene.previous.push_back(z);
    scene.current_px.emplace_back(now->x() + noise_px(random), now->y() + noise_px(random));
    if (outlier_every > 0 && i % outlier_every == 0) scene.current_px.back().x() += 20.0;
  }
  return scene;
}

[[nodiscard]] Pose motion(double ahead_m, double yaw_rad) {
  Vector6<double> change;
  change << 0.002, yaw_rad, 0.001, 0.02, -0.01, ahead_m;
  return Pose::exp(change);
}

TEST_CASE("The error that all disparities share is found from one motion of the left image",
          "[stereo_slam][rectification]") {
  std::mt19937_64 random(3);
  for (const double size_px : {-6.0, -2.0, 1.0, 4.0, 10.0}) {
    // By a shift of the right image, and by a rotation of its camera.
    for (const Vector2<double>& displacement_px :
         {Vector2<double>(size_px, 0.0), Vector2<double>(size_px, size_px)}) {
      const auto error = moved_scene(random, motion(1.0, 0.05), displacement_px, 5).error();
      REQUIRE(error);
      CHECK(error->is_clear());
      const Vector2<double> wrong_px = error->displacement_px - displacement_px;
      CHECK(wrong_px.dot(error->covariance_px2.inverse() * wrong_px) < 16.0);  // four sigma
      CHECK(std::abs(wrong_px.x()) < 0.7);
    }
  }
}

TEST_CASE("Exact disparities show no clear error", "[stereo_slam][rectification]") {
  std::mt19937_64 random(4);
  for (int i = 0; i < 20; ++i) {
    const auto error = moved_scene(random, motion(0.3 + 0.1 * i, 0.02), {0.0, 0.0}, 6).error();
    REQUIRE(error);
    CHECK_FALSE(error->is_clear());
  }
}

TEST_CASE("A camera that only turns tells nothing of the disparities", "[stereo_slam][rectification]") {
  std::mt19937_64 random(5);
  Vector6<double> turn = Vector6<double>::Zero();
  turn[1] = 0.05;
  const auto error = moved_scene(random, Pose::exp(turn), {3.0, 0.0}).error();
  if (error) CHECK_FALSE(error->is_clear());
}

TEST_CASE("No error is found from points that agree on no motion, or from none",
          "[stereo_slam][rectification]") {
  CHECK_FALSE(MovedScene{}.error());
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> anywhere_px(0.0, 370.0);
  MovedScene scene = moved_scene(random, motion(1.0, 0.0), {0.0, 0.0});
  for (auto& px : scene.current_px) px = {anywhere_px(random) * 3.0, anywhere_px(random)};
  CHECK_FALSE(scene.error());
}

TEST_CASE("Points without a finite position are not found to agree", "[stereo_slam][rectification]") {
  std::mt19937_64 random(7);
  MovedScene scene = moved_scene(random, motion(1.0, 0.0), {2.0, 0.0});
  scene.current_px[3].x() = std::numeric_limits<double>::quiet_NaN();
  const auto error = scene.error();
  if (error) CHECK(error->displacement_px.allFinite());
}

}  // namespace
}  // namespace stereo_slam
