// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/update.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include <Eigen/Cholesky>

#include "stereo_slam/support/matched_scene.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/tracking/pose_likelihood.hpp"
#include "stereo_slam/tracking/predict.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

using test::make_scene;
using test::MatchedScene;

constexpr double kSigma_px = test::kSceneSigma_px;

UpdateSettings settings_for(PoseUpdateMethod method) {
  UpdateSettings settings;
  settings.method = method;
  settings.robust_cap = 1e3;
  settings.student_t_inverse_dof = 0.0;  // the noise of make_scene() is normal
  return settings;
}

TEST_CASE("The likelihood is highest at the true pose, and equal for a pose and its antipode",
          "[stereo_slam][update]") {
  std::mt19937_64 random(1);
  const Pose truth = test::car_motion();
  const MatchedScene scene = make_scene(random, truth, 60, 0.01, 0.1);
  const PoseLikelihood likelihood(scene.matches, scene.map(), 1e6);
  CHECK(likelihood.dimension() == 180);
  const double at_truth = likelihood.squared_distance(truth);
  CHECK(at_truth < 180 + 5 * std::sqrt(360.0));
  CHECK(likelihood.squared_distance(scene.prior.pose) > 5 * at_truth);
  antipode::Matrix<double, 8, 2> poses;
  poses << truth.coeffs(), -truth.coeffs();
  antipode::Vector<double, 2> values;
  likelihood(poses, values);
  CHECK(values[0] == values[1]);
  CHECK(values[0] == Approx(-0.5 * at_truth).epsilon(1e-14));
}

TEST_CASE("A landmark behind a sampled camera costs the cap, not a NaN", "[stereo_slam][update]") {
  std::mt19937_64 random(2);
  const MatchedScene scene = make_scene(random, test::car_motion(), 20, 0.01, 0.1);
  const PoseLikelihood likelihood(scene.matches, scene.map(), 16.0);
  Vector6<double> far_ahead = Vector6<double>::Zero();
  far_ahead[5] = 100.0;
  CHECK(likelihood.squared_distance(Pose::exp(far_ahead)) == Approx(20 * 16.0));
  // Without a cap it is impossible, however many landmarks there are.
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const std::size_t count : {1u, 2u, 3u, 4u, 18u}) {
    CAPTURE(count);
    const PoseLikelihood uncapped(std::span<const Match>(scene.matches).first(count), scene.map(), kInfinity);
    CHECK(uncapped.squared_distance(Pose::exp(far_ahead)) == kInfinity);
  }
}

TEST_CASE("Distances of any number of landmarks add up", "[stereo_slam][update]") {
  std::mt19937_64 random(4);
  const Pose truth = test::car_motion();
  const MatchedScene scene = make_scene(random, truth, 9, 0.01, 0.1);
  const std::span<const Match> matches(scene.matches);
  const Pose pose = scene.prior.pose;
  double sum = 0.0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    sum += PoseLikelihood(matches.subspan(i, 1), scene.map(), 16.0).squared_distance(pose);
    const PoseLikelihood likelihood(matches.first(i + 1), scene.map(), 16.0);
    CHECK(likelihood.squared_distance(pose) == Approx(sum).epsilon(1e-12));
    CHECK(likelihood.dimension() == 3 * static_cast<int>(i + 1));
  }
  CHECK(PoseLikelihood({}, scene.map(), 16.0).squared_distance(pose) == 0.0);
}

TEST_CASE("Every method moves the pose to the landmarks", "[stereo_slam][update]") {
  const auto method = GENERATE(PoseUpdateMethod::kQuadratic, PoseUpdateMethod::kLeastSquares);
  std::mt19937_64 random(3);
  const Pose truth = test::car_motion();
  const auto check = [&](const MatchedScene& scene, const Pose& posterior) {
    const Vector6<double> before = truth.boxminus(scene.prior.pose);
    const Vector6<double> after = truth.boxminus(posterior);
    CHECK(after.head<3>().norm() < 0.4 * before.head<3>().norm() + 0.0015);
    CHECK(after.tail<3>().norm() < 0.4 * before.tail<3>().norm() + 0.05);
  };
  for (int run = 0; run < 5; ++run) {
    const MatchedScene scene = make_scene(random, truth, 90, 0.005, 0.1);
    CAPTURE(static_cast<int>(method), run);
    UpdateSettings settings = settings_for(method);
    const auto update = update_pose(scene.prior, scene.matches, scene.map(), settings);
    REQUIRE(update.converged);
    check(scene, update.posterior.pose);
    settings.tau = 0.05;
    const auto as_in_paper =
        update_as_in_paper(antipode::to_bingham_gaussian(scene.prior), scene.matches, scene.map(), settings);
    REQUIRE(as_in_paper.converged);
    check(scene, as_in_paper.posterior.pose());
  }
}

TEST_CASE("The covariance and the innovation of the updates are consistent", "[stereo_slam][update]") {
  constexpr int kRuns = 100;
  const auto method = GENERATE(PoseUpdateMethod::kQuadratic, PoseUpdateMethod::kLeastSquares);
  std::mt19937_64 random(4);
  const Pose truth = test::car_motion();
  double nees = 0.0;
  double nis = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const MatchedScene scene = make_scene(random, truth, 60, 0.005, 0.1);
    const auto update = update_pose(scene.prior, scene.matches, scene.map(), settings_for(method));
    const PoseGaussian posterior = update.posterior;
    const Vector6<double> error = truth.boxminus(posterior.pose);
    nees += error.dot(posterior.covariance.ldlt().solve(error)) / kRuns;
    nis += update.nis / update.nis_dof / kRuns;
  }
  CAPTURE(nees, nis);
  CHECK(nees > 5.34);  // 95 % band of the mean of 100 chi-squares with 6 degrees of freedom
  CHECK(nees < 6.70);
  CHECK(std::abs(nis - 1.0) < 3.0 * std::sqrt(2.0 / (180.0 * kRuns)));
}

TEST_CASE("The variance ratio of an update is that of the noise along and across the rows",
          "[stereo_slam][update]") {
  constexpr int kRuns = 300;
  constexpr double kVariance_px2 = 2.0 * kSigma_px * kSigma_px;  // of a residual: landmark and measurement
  const auto [rotation_sigma_rad, translation_sigma_m] =
      GENERATE(std::pair{0.005, 0.1}, std::pair{0.0002, 0.005});
  const int count = GENERATE(12, 60);
  const double ratio_v = GENERATE(1.0, 1.5);
  std::mt19937_64 random(6);
  std::normal_distribution<double> more(0.0, std::sqrt((ratio_v - 1.0) * kVariance_px2));
  UpdateSettings settings = settings_for(PoseUpdateMethod::kQuadratic);
  settings.robust_cap = UpdateSettings{}.robust_cap;
  Vector2<double> mean = Vector2<double>::Zero();
  for (int run = 0; run < kRuns; ++run) {
    MatchedScene scene =
        make_scene(random, test::car_motion(), count, rotation_sigma_rad, translation_sigma_m);
    if (ratio_v > 1.0) {
      for (auto& match : scene.matches) match.z.y() += more(random);
    }
    mean += update_pose(scene.prior, scene.matches, scene.map(), settings).variance_ratio / kRuns;
  }
  CAPTURE(rotation_sigma_rad, count, ratio_v, mean.transpose());
  // Of few residuals, those in v have lost more to the fit than those in u.
  const double tolerance = count == 12 ? 0.15 : 0.1;
  CHECK(mean.x() == Approx(1.0).epsilon(tolerance));
  CHECK(mean.y() == Approx(ratio_v).epsilon(tolerance));
}

TEST_CASE("Landmarks that share their error with the pose have the likelihood of the joint Gaussian",
          "[stereo_slam][update]") {
  std::mt19937_64 random(7);
  const StereoCamera camera = test::kitti_camera();
  MatchedScene scene = make_scene(random, test::car_motion(), 12, 0.005, 0.1);
  const PoseGaussian prior = scene.prior;
  std::uniform_real_distribution<double> uniform(-0.1, 0.1);
  // Correlations of up to a tenth: what is left of twelve landmarks' errors must be positive definite.
  const Matrix6<double> L = prior.covariance.llt().matrixL();
  for (auto& landmark : scene.landmarks) {
    Matrix6x3 correlation;
    for (double& entry : correlation.reshaped()) entry = uniform(random);
    const Matrix3<double> L_landmark = landmark.covariance.llt().matrixL();
    landmark.pose_cross_covariance = L * correlation * L_landmark.transpose();
  }
  const Pose x = prior.pose.boxplus(0.3 * scene.prior.covariance.diagonal().cwiseSqrt());
  const Vector6<double> xi = x.boxminus(prior.pose);
  const auto count = static_cast<Eigen::Index>(scene.matches.size());
  Eigen::VectorXd e(3 * count);
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(3 * count, 3 * count);
  Eigen::MatrixXd JC(3 * count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    auto& match = scene.matches[static_cast<std::size_t>(i)];
    const Landmark& landmark = scene.landmarks[match.landmark];
    const Matrix3<double> J = landmark_jacobian(landmark, prior.pose, camera);
    match.predicted.landmark_part = J * landmark.covariance * J.transpose();
    JC.middleRows<3>(3 * i) = J * landmark.pose_cross_covariance.transpose();
    S.block<3, 3>(3 * i, 3 * i) = match.predicted.landmark_part + match.R;
    const auto h = project(to_point(landmark, landmark.mean, camera), x, camera);
    REQUIRE(h);
    e.segment<3>(3 * i) = match.z - *h - JC.middleRows<3>(3 * i) * prior.covariance.ldlt().solve(xi);
  }
  S -= JC * prior.covariance.ldlt().solve(JC.transpose());
  const PoseLikelihood likelihood(scene.matches, scene.map(), 1e6, prior);
  CHECK(likelihood.squared_distance(x) == Approx(e.dot(S.ldlt().solve(e))).epsilon(1e-8));
}

TEST_CASE("Wrong matches are capped", "[stereo_slam][update]") {
  std::mt19937_64 random(5);
  const Pose truth = test::car_motion();
  MatchedScene scene = make_scene(random, truth, 100, 0.002, 0.02);
  for (std::size_t i = 0; i < 10; ++i) scene.matches[i].z.x() += 12.0;
  UpdateSettings settings =
      settings_for(GENERATE(PoseUpdateMethod::kQuadratic, PoseUpdateMethod::kLeastSquares));
  settings.robust_cap = 16.0;
  const auto update = update_pose(scene.prior, scene.matches, scene.map(), settings);
  const Vector6<double> error = truth.boxminus(update.posterior.pose);
  CHECK(error.head<3>().norm() < 1e-3);
  CHECK(error.tail<3>().norm() < 0.03);
}

TEST_CASE("Too few matches, or none, leave the prior as it is", "[stereo_slam][update]") {
  std::mt19937_64 random(6);
  for (const int count : {0, 5}) {
    const MatchedScene scene = make_scene(random, test::car_motion(), count, 0.005, 0.1);
    const auto update = update_pose(scene.prior, scene.matches, scene.map(), UpdateSettings{});
    CHECK_FALSE(update.converged);
    CHECK(update.posterior.pose.coeffs() == scene.prior.pose.coeffs());
  }
}

TEST_CASE("Prediction composes and its covariance grows with the lever arm", "[stereo_slam][update]") {
  PoseGaussian odometry;
  odometry.pose = test::car_motion(10.0);
  odometry.covariance = 1e-8 * Matrix6<double>::Identity();
  Matrix6<double> P = Matrix6<double>::Zero();
  P.diagonal() << 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6;
  const PoseGaussian state{test::car_motion(3.0), P};
  const MotionSettings settings;
  const PoseGaussian predicted = predict_pose(state, odometry);
  CHECK(predicted.pose.is_approx(test::car_motion(3.0) * odometry.pose, 1e-9));
  CHECK(predicted.covariance(3, 3) > 90e-6);           // (10 m)^2 * 1e-6 rad^2 of yaw, sideways
  CHECK(std::abs(predicted.covariance(1, 3)) > 5e-6);  // and correlated with it
  const ExpectedMotion steady{odometry.pose, 0.003, 0.02};
  const PoseGaussian guessed = predict_pose(state, guessed_motion(steady, settings));
  CHECK(guessed.pose.is_approx(predicted.pose, 1e-9));
  CHECK(guessed.covariance(5, 5) == Approx(0.02 * 0.02).epsilon(0.05));
  CHECK(predict_pose(state, guessed_motion(steady, settings, {1.0, 1.0})).covariance(5, 5) > 0.4);
  const PoseGaussian lost = predict_pose(state, guessed_motion({odometry.pose}, settings));
  CHECK(lost.covariance(5, 5) > 0.9 * settings.lost_translation_sigma_m * settings.lost_translation_sigma_m);
  double variance = 0.0;  // of ten lost frames in a row
  const auto lost_variance = [&](const UnseenSteps& unseen) {
    return predict_pose(state, guessed_motion({}, settings, unseen)).covariance(5, 5) -
           state.covariance(5, 5);
  };
  for (int k = 0; k < 10; ++k) variance += lost_variance({static_cast<double>(k), 1.0});
  CHECK(lost_variance({0.0, 10.0}) == Approx(variance).epsilon(0.01));  // or in one frame as long as they
  CHECK(std::sqrt(variance) == Approx(10.0 * settings.lost_translation_sigma_m).epsilon(0.01));
  const PoseGaussian independent =
      antipode::to_pose_gaussian(predict_as_in_paper(antipode::to_bingham_gaussian(state), odometry));
  CHECK(std::abs(independent.covariance(1, 3)) < 1e-12);
}

TEST_CASE("Composing estimates many times keeps them unit", "[stereo_slam][update]") {
  PoseGaussian pose;
  PoseGaussian step;
  step.pose = test::car_motion();
  step.covariance = 1e-8 * Matrix6<double>::Identity();
  for (int i = 0; i < 5000; ++i) pose = compose(pose, step);
  CHECK(std::abs(pose.pose.real().norm() - 1.0) < 1e-14);
  CHECK(std::abs(pose.pose.real().dot(pose.pose.dual())) < 1e-10);
  CHECK(pose.covariance.ldlt().isPositive());
}

}  // namespace
}  // namespace stereo_slam
