// SPDX-License-Identifier: MIT
#include "stereo_slam/results/pose_frame.hpp"

#include <Eigen/Cholesky>

#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Poses, covariances and points of the camera become those of the body", "[pose_frame]") {
  Vector6<double> twist;
  twist << 0.3, -1.2, 0.7, 0.1, -0.4, 0.2;
  const Pose X = Pose::exp(twist);
  Eigen::Isometry3d T_body_camera = Eigen::Isometry3d::Identity();
  T_body_camera.linear() = X.rotation_matrix();
  T_body_camera.translation() = X.translation();

  RunRecord record;
  record.results.resize(1);
  record.trajectory.resize(1);
  const Pose T_world_camera = car_motion();
  record.trajectory[0].pose = record.results[0].T_world_camera.pose = T_world_camera;
  const Matrix6<double> A = Matrix6<double>::Random();
  const Matrix6<double> P = 1e-4 * A * A.transpose();
  record.trajectory[0].covariance = P;
  record.results[0].relative_covariance = P;
  record.map_points = {{{1.0, -2.0, 3.0}, 9}};
  record.loops.resize(1);
  record.loops[0].T_old_new = T_world_camera;

  const RunRecord body = in_body_frame(record, T_body_camera);
  const Pose T_world_body = body.trajectory[0].pose;
  CHECK(T_world_body.is_approx(X * T_world_camera * X.inverse(), 1e-12));
  CHECK(body.loops[0].T_old_new.is_approx(T_world_body, 1e-12));
  CHECK((body.map_points[0].position_world - X * Vector3<double>(1.0, -2.0, 3.0)).norm() < 1e-12);

  // A perturbed camera is a body perturbed by Ad(X) xi, so that the Mahalanobis distance is the same.
  const Vector6<double> xi = 1e-3 * Vector6<double>::Random();
  const Pose perturbed = X * T_world_camera.boxplus(xi) * X.inverse();
  const Vector6<double> xi_body = (T_world_body.inverse() * perturbed).log();
  const double camera_distance = xi.dot(P.ldlt().solve(xi));
  for (const auto& covariance : {body.trajectory[0].covariance, body.results[0].relative_covariance})
    CHECK(xi_body.dot(covariance.ldlt().solve(xi_body)) == Approx(camera_distance).epsilon(1e-6));
}

TEST_CASE("Poses of a body that the calibration does not contain are refused", "[pose_frame]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 2);
  CHECK_THAT(message_of([&] { (void)require_body(open_sequence(folder.path(), "auto")); }),
             Catch::Contains("leave out --pose-frame body"));
}
