// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/odometry_covariance.hpp"

#include <Eigen/Eigenvalues>

#include "stereo_slam/slam/path.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr CalibrationError kError{.scale_sigma = 0.002, .axes_sigma_rad = 0.001, .common_error_rad = 2e-4};

[[nodiscard]] Matrix6<double> covariance_of_step() {
  Vector6<double> sigma;
  sigma << 1e-3, 2e-3, 1e-3, 0.01, 0.02, 0.03;
  return sigma.cwiseAbs2().asDiagonal();
}

/// The results of a car that drives `frames` frames with a keyframe every third one, by the program's Path.
[[nodiscard]] std::vector<FrameResult> drive(int frames) {
  Path path;
  path.trajectory().begin(0);
  std::vector<FrameResult> results;
  PoseGaussian T_keyframe_camera;
  for (int i = 0; i < frames; ++i) {
    FrameResult result;
    result.index = static_cast<std::size_t>(i);
    result.status = i == 0 ? TrackingStatus::kInitializing : TrackingStatus::kOk;
    if (i > 0) {
      T_keyframe_camera.pose = T_keyframe_camera.pose * car_motion();
      T_keyframe_camera.covariance += covariance_of_step();
    }
    path.append(T_keyframe_camera, true, kError, result);
    if (i == 0) result.is_keyframe = true;
    if (i > 0 && i % 3 == 0) {
      result.is_keyframe = true;
      path.trajectory().add_keyframe(result.index, {T_keyframe_camera});
      path.report_keyframe(result);
      T_keyframe_camera = {};
    }
    results.push_back(result);
  }
  return results;
}

[[nodiscard]] double relative_difference(const Matrix6<double>& a, const Matrix6<double>& b) {
  return a == b ? 0.0 : (a - b).norm() / b.norm();
}

}  // namespace

TEST_CASE("Without loops the covariance is that of the pose in the map", "[ros2]") {
  OdometryCovariance covariance;
  for (const auto& result : drive(20)) {
    const auto pose = covariance.next(result);
    CHECK(pose.pose.is_approx(result.T_odometry_camera, 1e-15));
    CHECK(pose.covariance == result.T_world_camera.covariance);
  }
}

TEST_CASE("A loop that moves the map leaves the covariance as it would be without the loop", "[ros2]") {
  OdometryCovariance covariance;
  Vector6<double> moved;
  moved << 0.01, 0.0, 0.02, 0.3, -0.1, 0.2;
  const auto results = drive(20);
  for (std::size_t i = 0; i < results.size(); ++i) {
    FrameResult result = results[i];
    if (i >= 10) {  // the loop corrects the poses in the map, and makes them certain
      result.loop_corrected = i == 10;
      result.T_world_camera.pose = Pose::exp(moved) * result.T_world_camera.pose;
      result.T_world_camera.covariance *= 0.01;
    }
    const auto pose = covariance.next(result);
    CHECK(pose.pose.is_approx(results[i].T_odometry_camera, 1e-15));
    CHECK(relative_difference(pose.covariance, results[i].T_world_camera.covariance) < 1e-9);
  }
}

TEST_CASE("After a loss the uncertainty of the predicted motion remains", "[ros2]") {
  OdometryCovariance covariance;
  auto results = drive(20);
  Vector6<double> wrong;
  wrong << 0.0, 0.05, 0.0, 0.5, 0.0, 1.0;
  const Matrix6<double> lost = 0.25 * Matrix6<double>::Identity();
  for (std::size_t i = 10; i < results.size(); ++i) {
    if (i == 10) {
      results[i].status = TrackingStatus::kLost;
      results[i].relative_covariance += lost;
      results[i].T_world_camera.covariance += lost;
    }
    if (i == 11) results[i].status = TrackingStatus::kRelocalised;
    // The odometry frame goes on from a pose that was predicted wrongly; in the map it is right again.
    results[i].T_odometry_camera = results[10].T_odometry_camera * Pose::exp(wrong) *
                                   results[10].T_odometry_camera.inverse() * results[i].T_odometry_camera;
  }
  for (std::size_t i = 0; i < results.size(); ++i) {
    const auto pose = covariance.next(results[i]);
    const double largest = Eigen::SelfAdjointEigenSolver<Matrix6<double>>(pose.covariance).eigenvalues()[5];
    if (i < 10) CHECK(largest < 0.2);
    if (i >= 10) CHECK(largest > 0.25);
    CHECK((pose.covariance - pose.covariance.transpose()).norm() < 1e-12);
  }
}
