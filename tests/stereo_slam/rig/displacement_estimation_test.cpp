// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/displacement_estimation.hpp"

#include <cstddef>
#include <random>
#include <vector>

#include <Eigen/LU>

#include <antipode/geometry/quaternion.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/rig/rectification_estimator.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr double kNoise_px = 0.1;

/// Points seen by a camera that has moved by `pose_change`, with a right image that is displaced. One in
/// `outlier_every` moves by itself.
std::vector<DisplacementConstraint> displaced_scene(std::mt19937_64& random, const Pose& pose_change,
                                                    const ImageDisplacement::Coefficients& displacement,
                                                    int outlier_every) {
  const StereoCamera camera = test::kitti_camera();
  const PairGeometry exact(camera);
  const PairGeometry displaced = exact.displaced(displacement);
  std::normal_distribution<double> noise(0.0, kNoise_px);
  std::vector<DisplacementConstraint> constraints;
  for (int i = 0; i < 150; ++i) {
    const Vector3<double> p = camera.back_project(test::random_measurement(random, camera, 2.0, 60.0));
    const auto now = camera.project(pose_change.inverse() * p);
    if (!now) continue;
    Vector2<double> right_px = displaced.right_position(*now);
    right_px += Vector2<double>(noise(random), noise(random));
    if (outlier_every > 0 && i % outlier_every == 0) right_px.x() += 15.0;
    const StereoMeasurement measured = exact.measure(now->head<2>(), right_px);
    const Matrix3<double> J = camera.projection_jacobian(p);
    DisplacementConstraint c{.innovation = measured.z - camera.project_unchecked(p),
                             .S_inverse = (2.0 * stereo_pixel_covariance(kNoise_px)).inverse(),
                             .J_pose = {},
                             .row_error_px = measured.row_error_px,
                             .basis = ImageDisplacement::basis(right_px, camera)};
    c.J_pose << J * antipode::skew(p), -J;
    constraints.push_back(c);
  }
  return constraints;
}

TEST_CASE("A displaced right image is measured as it was displaced", "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  ImageDisplacement::Coefficients displacement;
  displacement << 3.0, -1.0, 2.5, 3.0, -1.0;
  const PairGeometry displaced = PairGeometry(camera).displaced(displacement);
  std::mt19937_64 random(3);
  for (int i = 0; i < 50; ++i) {
    const StereoPoint z = test::random_measurement(random, camera, 2.0, 60.0);
    const StereoMeasurement measured = displaced.measure(z.head<2>(), displaced.right_position(z));
    CHECK((measured.z - z).cwiseAbs().maxCoeff() < 0.03);
    CHECK(std::abs(measured.row_error_px) < 0.03);
  }
}

TEST_CASE("Pose and displacement are told apart, also with outliers", "[stereo_slam][odometry]") {
  const int outlier_every = GENERATE(0, 20, 5);
  CAPTURE(outlier_every);
  std::mt19937_64 random(11);
  ImageDisplacement::Coefficients displacement;
  displacement << -2.0, 0.7, 1.5, -2.0, 0.7;
  Vector6<double> change;
  change << 0.001, -0.002, 0.001, 0.01, -0.01, 0.03;
  double sum = 0.0;
  constexpr int kScenes = 40;
  for (int scene = 0; scene < kScenes; ++scene) {
    const auto points =
        displaced_scene(random, Pose::identity().boxplus(change), displacement, outlier_every);
    const auto estimate = estimate_displacement(points, {});
    REQUIRE(estimate);
    const ImageDisplacement::Coefficients error = estimate->change - displacement;
    CHECK(error.head<3>().cwiseAbs().maxCoeff() < 0.2);
    CHECK((estimate->pose_change - change).head<3>().norm() < 1e-3);
    sum += error.dot(estimate->covariance.inverse() * error);
  }
  // The mean NEES of five unknowns; the rows are assumed noisier than they are here.
  CHECK(sum / kScenes < 7.0);
  CHECK(sum / kScenes > 1.0);
}

TEST_CASE("A prior of a rigid rig leaves no displacement", "[stereo_slam][odometry]") {
  std::mt19937_64 random(5);
  DisplacementPrior rigid;
  rigid.information = ImageDisplacement::Covariance::Identity() * 1e12;
  const auto estimate = estimate_displacement(
      displaced_scene(random, Pose::identity(), ImageDisplacement::Coefficients::Zero(), 0), rigid);
  REQUIRE(estimate);
  CHECK(estimate->change.norm() < 1e-4);
}

TEST_CASE("Without points nothing is estimated", "[stereo_slam][odometry]") {
  CHECK_FALSE(estimate_displacement({}, {}));
}

}  // namespace
}  // namespace stereo_slam
