// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/landmark.hpp"

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr double kStep = 1e-6;

Landmark landmark_from(const Pose& T_reference_anchor, const StereoPoint& z) {
  Landmark landmark = test::landmark_at(z, 0.3);
  landmark.T_reference_anchor = T_reference_anchor;
  return landmark;
}

TEST_CASE("A landmark projects to the same pixels as its point in space", "[stereo_slam][landmark]") {
  std::mt19937_64 random(1);
  const StereoCamera camera = test::kitti_camera();
  for (int i = 0; i < 50; ++i) {
    const Pose anchor = test::car_motion(2.0);
    const Pose viewer = test::car_motion(3.0);
    const StereoPoint z = test::random_measurement(random, camera, 10.0, 80.0);
    const HomogeneousPoint in_space{anchor * camera.back_project(z), 1.0};
    const auto a = project(in_space, viewer, camera);
    const auto b = project(to_point(landmark_from(anchor, z), z, camera), viewer, camera);
    REQUIRE(a);
    REQUIRE(b);
    CHECK((*a - *b).norm() < 1e-9);
  }
}

TEST_CASE("A point at infinity has a direction, no disparity and no parallax", "[stereo_slam][landmark]") {
  const StereoCamera camera = test::kitti_camera();
  const Landmark star = landmark_from(Pose::identity(), {700.0, 100.0, 0.0});
  Vector6<double> sideways = Vector6<double>::Zero();
  sideways[3] = 5.0;
  const auto z = project(to_point(star, star.mean, camera), Pose::exp(sideways), camera);
  REQUIRE(z);
  CHECK((*z - star.mean).norm() < 1e-12);
}

TEST_CASE("Points behind the camera and in its centre do not project", "[stereo_slam][landmark]") {
  const StereoCamera camera = test::kitti_camera();
  for (const double z : {-5.0, 0.0, 0.05}) {
    CHECK_FALSE(project({Vector3<double>(1.0, 0.0, z), 1.0}, Pose::identity(), camera));
    CHECK_FALSE(camera.project({1.0, 0.0, z}));
  }
  CHECK_FALSE(camera.project({0.0, 0.0, std::numeric_limits<double>::quiet_NaN()}));
}

TEST_CASE("The sign of the pose's dual quaternion does not matter", "[stereo_slam][landmark]") {
  const StereoCamera camera = test::kitti_camera();
  const Pose pose = test::car_motion();
  const Pose antipode = Pose::unchecked(-pose.coeffs());
  const HomogeneousPoint point{Vector3<double>(1.0, -2.0, 20.0), 1.0};
  CHECK(*project(point, pose, camera) == *project(point, antipode, camera));
}

TEST_CASE("Jacobians of the projection agree with differences", "[stereo_slam][landmark]") {
  std::mt19937_64 random(2);
  const StereoCamera camera = test::kitti_camera();
  const Pose pose = test::car_motion();
  for (const Pose& anchor : {Pose::identity(), test::car_motion(-0.7)}) {
    const Landmark landmark = landmark_from(anchor, test::random_measurement(random, camera, 5.0, 40.0));
    const HomogeneousPoint point = to_point(landmark, landmark.mean, camera);
    Eigen::Matrix<double, 3, 6> J_pose;
    for (int k = 0; k < 6; ++k) {
      const Vector6<double> step = kStep * Vector6<double>::Unit(k);
      J_pose.col(k) = (*project(point, pose.boxplus(step), camera) -
                       *project(point, pose.boxplus(Vector6<double>(-step)), camera)) /
                      (2.0 * kStep);
    }
    Matrix3<double> J_landmark;
    for (int k = 0; k < 3; ++k) {
      const Vector3<double> step = kStep * Vector3<double>::Unit(k);
      J_landmark.col(k) = (*project(to_point(landmark, landmark.mean + step, camera), pose, camera) -
                           *project(to_point(landmark, landmark.mean - step, camera), pose, camera)) /
                          (2.0 * kStep);
    }
    // central differences of pixels (about 1e3) at 1e-6: rounding of 1e-7 relative to the largest entry
    const auto expected_pose = pose_jacobian(point, pose, camera);
    const auto expected_landmark = landmark_jacobian(landmark, pose, camera);
    CHECK((J_pose - expected_pose).cwiseAbs().maxCoeff() < 1e-6 * expected_pose.cwiseAbs().maxCoeff());
    CHECK((J_landmark - expected_landmark).cwiseAbs().maxCoeff() <
          1e-6 * (1.0 + expected_landmark.cwiseAbs().maxCoeff()));
  }
  const Vector3<double> p(2.0, -1.0, 15.0);
  const Matrix3<double> product =
      camera.projection_jacobian(p) * camera.back_projection_jacobian(camera.project_unchecked(p));
  CHECK((product - Matrix3<double>::Identity()).norm() < 1e-12);
}

TEST_CASE("Only landmarks in view and in range are expected, with both parts of their uncertainty",
          "[stereo_slam][landmark]") {
  const StereoCamera camera = test::kitti_camera();
  const auto at_depth = [&](double z_m) {
    return test::landmark_at({600.0, 180.0, camera.fx * camera.baseline_m / z_m}, 0.3);
  };
  std::vector<Landmark> landmarks = {at_depth(10.0), at_depth(60.0), at_depth(80.0), at_depth(10.0)};
  landmarks[3].mean.x() += 700.0;  // out of view
  PoseGaussian pose;
  pose.covariance = 1e-6 * Matrix6<double>::Identity();
  const auto predicted = project_landmarks({landmarks, camera}, pose, 140.0);  // 75 m
  REQUIRE(predicted.size() == 2);
  CHECK(predicted[0].index == 0);
  CHECK(predicted[1].index == 1);
  CHECK((predicted[0].landmark_part - stereo_pixel_covariance(0.3)).norm() <
        0.02 * stereo_pixel_covariance(0.3).norm());
  const auto J = pose_jacobian(to_point(landmarks[0], landmarks[0].mean, camera), pose.pose, camera);
  CHECK((predicted[0].pose_part - 1e-6 * J * J.transpose()).norm() < 1e-12);
}

}  // namespace
}  // namespace stereo_slam
