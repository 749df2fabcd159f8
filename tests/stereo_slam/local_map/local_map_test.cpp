// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/local_map.hpp"

#include <random>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

StereoFrame grey_frame(std::size_t index) {
  return {index, 0, cv::Mat(376, 1241, CV_8UC1, cv::Scalar(80)), cv::Mat(376, 1241, CV_8UC1, cv::Scalar(80))};
}

StereoPoint at_depth(double z_m) {
  const StereoCamera camera = test::kitti_camera();
  return {700.0, 150.0, camera.fx * camera.baseline_m / z_m};
}

LocalMap map_of(const std::vector<StereoPoint>& measurements, const PoseGaussian& pose = {}) {
  MapSettings settings;
  settings.pixel_sigma_px = 0.4;
  LocalMap map(test::kitti_camera(), settings);
  std::vector<std::uint32_t> ids;
  while (ids.size() < measurements.size()) ids.push_back(map.new_id());
  map.add(test::points_at(measurements), ids, pose, grey_frame(0));
  return map;
}

TEST_CASE("Near and far points become landmarks, too far ones do not", "[stereo_slam][map]") {
  const LocalMap map = map_of({at_depth(10.0), at_depth(30.0), at_depth(80.0)});  // 140 baselines are 75 m
  REQUIRE(map.landmarks().size() == 2);
  CHECK((map.landmarks()[0].mean - at_depth(10.0)).norm() < 1e-12);
  CHECK((map.landmarks()[1].mean - at_depth(30.0)).norm() < 1e-12);
  CHECK(map.landmarks()[0].id != map.landmarks()[1].id);
  CHECK(map.landmarks()[0].intensity == 80);
}

TEST_CASE("Landmarks whose patches agree less in the two images are added only where clear ones are few",
          "[stereo_slam][map]") {
  MapSettings settings;
  settings.max_new_landmarks = 10;
  const auto added = [&](const std::vector<double>& correlations) {
    StereoPoints points = test::points_at(std::vector<StereoPoint>(correlations.size(), at_depth(10.0)));
    for (std::size_t i = 0; i < correlations.size(); ++i) {
      points.measured[i].correlation = std::abs(correlations[i]);
      points.measured[i].on_common_surface = correlations[i] > 0.0;
    }
    LocalMap map(test::kitti_camera(), settings);
    map.add(points, std::vector<std::uint32_t>(correlations.size(), 1), PoseGaussian{}, grey_frame(0));
    return map.landmarks().size();
  };
  CHECK(added({0.99, 0.9, 0.98, 0.97, 0.96, 0.99, 0.86, 0.99}) == 6);
  CHECK(added({0.99, 0.9, 0.86, 0.87, 0.88, 0.89, 0.91}) == 6);  // only .99 is clear: the best, too
  CHECK(added({0.5, 0.6, 0.7}) == 3);
  CHECK(added({}) == 0);
  CHECK(added({-0.99, 0.96, -0.98, 0.97, 0.96, 0.99, 0.86, 0.99}) == 6);  // negative: on no common surface
  CHECK(added({-0.99, 0.96, -0.98, 0.97, 0.96, 0.99, -0.97, -0.96, -0.99}) == 6);
  settings.clear_correlation = -1.0;
  CHECK(added({0.99, 0.9, 0.98, 0.97, 0.96, 0.99, 0.86, 0.99}) == 8);
}

TEST_CASE("A new landmark is as uncertain as its pixels and its pose", "[stereo_slam][map]") {
  constexpr int kSamples = 20000;
  std::mt19937_64 random(1);
  const StereoCamera camera = test::kitti_camera();
  PoseGaussian pose;
  pose.pose = test::car_motion(4.0);
  pose.covariance.diagonal() << 1e-6, 4e-6, 1e-6, 1e-4, 1e-4, 4e-4;
  pose.covariance(1, 3) = pose.covariance(3, 1) = -1e-5;
  const StereoPoint z = at_depth(9.0);
  const LocalMap map = map_of({z}, pose);
  const Matrix6<double> L = pose.covariance.llt().matrixL();
  Vector3<double> mean = Vector3<double>::Zero();
  Matrix3<double> second = Matrix3<double>::Zero();
  std::normal_distribution<double> normal;
  for (int i = 0; i < kSamples; ++i) {
    Vector6<double> n;
    for (double& x : n) x = normal(random);
    const Vector3<double> p =
        pose.pose.boxplus(Vector6<double>(L * n)) * camera.back_project(z + test::stereo_noise(random, 0.4));
    mean += p / kSamples;
    second += p * p.transpose() / kSamples;
  }
  const Matrix3<double> expected = second - mean * mean.transpose();
  const Matrix3<double> J = pose.pose.rotation_matrix() * camera.back_projection_jacobian(z);
  const Matrix3<double> actual = J * map.landmarks()[0].covariance * J.transpose();
  CAPTURE(expected, actual);
  CHECK((actual - expected).norm() < 0.05 * expected.norm());  // 1 % of sampling noise, the rest second order
}

TEST_CASE("Unobserved landmarks are culled; established ones are archived", "[stereo_slam][map]") {
  LocalMap map = map_of({at_depth(10.0), at_depth(12.0)});
  Match seen;
  seen.landmark = 0;
  seen.z = at_depth(10.0);
  for (std::size_t frame = 1; frame <= 3; ++frame) map.record_observations({seen}, {}, frame);
  map.cull(5);
  CHECK(map.landmarks().size() == 2);
  map.cull(6);
  REQUIRE(map.landmarks().size() == 1);
  CHECK(map.landmarks()[0].last_seen == 3);
  map.cull(20);
  CHECK(map.landmarks().empty());
  REQUIRE(map.archive().size() == 1);  // the other was seen once only
  CHECK(map.archive()[0].position.z() == Approx(10.0));
}

TEST_CASE("A restart archives the landmarks with their keyframe", "[stereo_slam][map]") {
  LocalMap map = map_of({at_depth(10.0)});
  Match seen;
  seen.z = at_depth(10.0);
  for (std::size_t frame = 1; frame <= 3; ++frame) map.record_observations({seen}, {}, frame);
  map.restart(7);
  CHECK(map.landmarks().empty());
  REQUIRE(map.archive().size() == 1);
  CHECK(map.archive()[0].keyframe == 0);
}

TEST_CASE("Updating landmarks shrinks their covariances and keeps them positive", "[stereo_slam][map]") {
  std::mt19937_64 random(2);
  LocalMap map = map_of({at_depth(10.0), at_depth(40.0)});
  const auto pose = PoseDensity::from_pose_covariance(Pose::identity(), 1e-8 * Matrix6<double>::Identity());
  std::vector<double> before;
  for (const auto& landmark : map.landmarks()) before.push_back(landmark.covariance.trace());
  std::vector<Match> matches;
  for (std::size_t i = 0; i < 2; ++i) {
    Match match;
    match.landmark = i;
    match.z = at_depth(i == 0 ? 10.0 : 40.0) + test::stereo_noise(random, 0.3);
    match.R = stereo_pixel_covariance(0.4);
    matches.push_back(match);
  }
  map.update(matches, pose);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& P = map.landmarks()[i].covariance;
    CHECK(P.trace() < 0.75 * before[i]);
    CHECK(Eigen::SelfAdjointEigenSolver<Matrix3<double>>(P).eigenvalues()[0] > 0.0);
  }
}

TEST_CASE("The correlation of pose and landmarks is that of a dense Schmidt filter", "[stereo_slam][map]") {
  constexpr int kLandmarks = 3, kRows = 3 * kLandmarks;
  LocalMap map = map_of({at_depth(8.0), {300.0, 250.0, 30.0}, {900.0, 60.0, 18.0}});
  REQUIRE(map.landmarks().size() == kLandmarks);
  const StereoCamera camera = test::kitti_camera();
  const Pose pose = test::car_motion(0.4);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const Matrix6<double> root = Matrix6<double>::NullaryExpr([&] { return 0.01 * normal(random); });
  PoseGaussian prior{pose, root * root.transpose()};
  for (int update = 0; update < 2; ++update) {  // the second begins with a correlation
    std::vector<Match> matches;
    Eigen::Matrix<double, kRows, 6> H;
    Eigen::Matrix<double, kRows, kRows> J_covariance = Eigen::Matrix<double, kRows, kRows>::Zero();
    Eigen::Matrix<double, kRows, kRows> D = J_covariance;
    Eigen::Matrix<double, 6, kRows> cross, cross_J;  // Cov(pose, landmarks), and times J'
    for (int k = 0; k < kLandmarks; ++k) {
      const Landmark& landmark = map.landmarks()[static_cast<std::size_t>(k)];
      const Matrix3<double> J = landmark_jacobian(landmark, pose, camera);
      Match match;
      match.landmark = static_cast<std::size_t>(k);
      match.R = stereo_pixel_covariance(0.4);
      match.predicted.landmark_part = J * landmark.covariance * J.transpose();
      H.middleRows<3>(3 * k) = pose_jacobian(to_point(landmark, landmark.mean, camera), pose, camera);
      D.block<3, 3>(3 * k, 3 * k) = match.predicted.landmark_part + match.R;
      J_covariance.block<3, 3>(3 * k, 3 * k) = J * landmark.covariance;
      cross.middleCols<3>(3 * k) = landmark.pose_cross_covariance;
      cross_J.middleCols<3>(3 * k) = landmark.pose_cross_covariance * J.transpose();
      matches.push_back(match);
    }
    const Eigen::Matrix<double, kRows, kRows> S =
        H * prior.covariance * H.transpose() + H * cross_J + cross_J.transpose() * H.transpose() + D;
    const Eigen::Matrix<double, 6, kRows> gain = (prior.covariance * H.transpose() + cross_J) *
                                                 S.ldlt().solve(Eigen::MatrixXd::Identity(kRows, kRows));
    map.update_correlation(prior, pose, matches);
    cross -= gain * (H * cross + J_covariance);
    for (int k = 0; k < kLandmarks; ++k) {
      const auto& updated = map.landmarks()[static_cast<std::size_t>(k)].pose_cross_covariance;
      const Eigen::Matrix<double, 6, 3> expected = cross.middleCols<3>(3 * k);
      CAPTURE(update, k);
      CHECK((updated - expected).norm() < 1e-9 * expected.norm());
    }
    prior.covariance -= gain * S * gain.transpose();
  }
}

}  // namespace
}  // namespace stereo_slam
