// SPDX-License-Identifier: MIT
#include <cmath>
#include <random>

#include <Eigen/Cholesky>

#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/support/matched_scene.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/tracking/update.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

const double kDefaultInverseDof = UpdateSettings{}.student_t_inverse_dof;

/// Errors of the matches besides the normal noise of make_scene().
enum class Tails { kNone, kOutliers, kStudent };

void add_tails(test::MatchedScene& scene, Tails tails, std::mt19937_64& random) {
  constexpr double kDof = 2.0;
  std::normal_distribution<double> normal;
  std::chi_squared_distribution<double> chi2(kDof);
  for (std::size_t i = 0; i < scene.matches.size(); ++i) {
    double sigma_px = 0.0;
    if (tails == Tails::kOutliers && i % 5 == 0) sigma_px = 5.0 * test::kSceneSigma_px;
    if (tails == Tails::kStudent) sigma_px = test::kSceneSigma_px * std::sqrt(kDof / chi2(random));
    for (double& component : scene.matches[i].z) component += sigma_px * normal(random);
  }
}

/// Multiplies what the update assumes to be the variance of the noise.
void assume(double variance, test::MatchedScene& scene) {
  for (auto& match : scene.matches) {
    match.R *= variance;
    match.predicted.landmark_part *= variance;
    scene.landmarks[match.landmark].covariance *= variance;
  }
}

/// Updates of the pose in many scenes.
struct Experiment {
  PoseUpdateMethod method = PoseUpdateMethod::kQuadratic;
  double inverse_dof = kDefaultInverseDof;
  Tails tails = Tails::kNone;
  double assumed_variance = 1.0;
  int matches = 120;
};

/// Means over the scenes.
struct Outcome {
  double nees = 0.0;  ///< with the covariance scaled to the residuals; 6 if that is right
  double nis = 0.0;   ///< per degree of freedom
  double squared_error_m2 = 0.0;
  Vector2<double> variance_ratio = Vector2<double>::Zero();
};

Outcome outcome_of(const Experiment& experiment) {
  constexpr int kRuns = 100;
  std::mt19937_64 random(8);
  UpdateSettings settings;
  settings.method = experiment.method;
  settings.student_t_inverse_dof = experiment.inverse_dof;
  const Pose truth = test::car_motion();
  Outcome outcome;
  for (int run = 0; run < kRuns; ++run) {
    test::MatchedScene scene = test::make_scene(random, truth, experiment.matches, 0.01, 0.2);
    add_tails(scene, experiment.tails, random);
    assume(experiment.assumed_variance, scene);
    const auto update = update_pose(scene.prior, scene.matches, scene.map(), settings);
    REQUIRE(update.converged);
    const PoseGaussian posterior = update.posterior;
    const Vector6<double> error = truth.boxminus(posterior.pose);
    const Matrix6<double> covariance = NoiseScale::scaled(posterior.covariance, update.variance_ratio);
    outcome.nees += error.dot(covariance.ldlt().solve(error)) / kRuns;
    outcome.nis += update.nis / update.nis_dof / kRuns;
    outcome.squared_error_m2 += error.tail<3>().squaredNorm() / kRuns;
    outcome.variance_ratio += update.variance_ratio / kRuns;
  }
  return outcome;
}

TEST_CASE("Covariances scaled to weighted residuals are consistent, with outliers and wrong variances, too",
          "[stereo_slam][update]") {
  const auto method = GENERATE(PoseUpdateMethod::kQuadratic, PoseUpdateMethod::kLeastSquares);
  const auto tails = GENERATE(Tails::kNone, Tails::kOutliers);
  const double assumed_variance = GENERATE(1.0, 4.0);
  const double nees =
      outcome_of({.method = method, .tails = tails, .assumed_variance = assumed_variance}).nees;
  CAPTURE(static_cast<int>(method), static_cast<int>(tails), assumed_variance, nees);
  CHECK(nees > 5.0);
  CHECK(nees < 7.0);
}

TEST_CASE("Of few matches, weights make the covariance no worse", "[stereo_slam][update]") {
  const auto nees = [](Tails tails, double inverse_dof) {
    return outcome_of({.inverse_dof = inverse_dof, .tails = tails, .matches = 20}).nees;
  };
  CHECK(nees(Tails::kNone, kDefaultInverseDof) < 1.1 * nees(Tails::kNone, 0.0));
  CHECK(nees(Tails::kOutliers, kDefaultInverseDof) < nees(Tails::kOutliers, 0.0));
}

TEST_CASE(
    "Weighted residuals show heavy tails, and noise larger than assumed, better than equally weighted ones",
    "[stereo_slam][update]") {
  const auto nees = [](double inverse_dof, Tails tails, double assumed_variance) {
    return outcome_of({.inverse_dof = inverse_dof, .tails = tails, .assumed_variance = assumed_variance})
        .nees;
  };
  CHECK(nees(0.5, Tails::kStudent, 1.0) < 0.9 * nees(0.0, Tails::kStudent, 1.0));
  // Errors beyond four assumed standard deviations are removed. What is left is too small.
  for (const double variance : {0.5, 0.3}) {
    const double weighted = nees(kDefaultInverseDof, Tails::kNone, variance);
    CAPTURE(variance, weighted);
    CHECK(weighted < nees(0.0, Tails::kNone, variance));
    CHECK(weighted < 10.0);
  }
}

TEST_CASE("Weights by residuals pay where the assumed variances are too large for the cap to find outliers",
          "[stereo_slam][update]") {
  const auto ratio = [](Tails tails, double assumed_variance) {
    Experiment experiment{.tails = tails, .assumed_variance = assumed_variance};
    const double weighted = outcome_of(experiment).squared_error_m2;
    experiment.inverse_dof = 0.0;
    return weighted / outcome_of(experiment).squared_error_m2;
  };
  CHECK(ratio(Tails::kOutliers, 4.0) < 0.65);
  CHECK(ratio(Tails::kStudent, 4.0) < 0.85);
  CHECK(ratio(Tails::kNone, 4.0) < 1.3);
  CHECK(ratio(Tails::kNone, 1.0) < 1.3);
}

TEST_CASE("The variance ratio and the innovation are as expected if the noise is as assumed",
          "[stereo_slam][update]") {
  UpdateSettings settings;
  settings.student_t_inverse_dof = GENERATE(0.05, kDefaultInverseDof, 0.5, 1.0);
  const double expected = expected_variance_ratio(settings);
  const Outcome outcome = outcome_of({.inverse_dof = settings.student_t_inverse_dof});
  CAPTURE(settings.student_t_inverse_dof);
  CHECK(outcome.variance_ratio.x() == Approx(expected).epsilon(0.05));
  CHECK(outcome.variance_ratio.y() == Approx(expected).epsilon(0.05));
  CHECK(outcome.nis == Approx(1.0).epsilon(0.05));
  settings.student_t_inverse_dof = 0.0;
  CHECK(expected_variance_ratio(settings) == 1.0);
}

TEST_CASE("Weighted residuals show noise that differs along and across the rows", "[stereo_slam][update]") {
  constexpr int kRuns = 100;
  std::mt19937_64 random(10);
  std::normal_distribution<double> normal;
  const Pose truth = test::car_motion();
  const Vector3<double> sigma_px = GENERATE(Vector3<double>(0.3, 1.0, 0.3), Vector3<double>(0.6, 0.3, 0.6));
  Vector6<double> mean_squares = Vector6<double>::Zero();
  for (int run = 0; run < kRuns; ++run) {
    test::MatchedScene scene = test::make_scene(random, truth, 120, 0.01, 0.2);
    for (auto& match : scene.matches) {
      const Landmark& landmark = scene.landmarks[match.landmark];
      match.z = project(to_point(landmark, landmark.mean, scene.camera), truth, scene.camera).value();
      match.z += sigma_px.cwiseProduct(test::stereo_noise(random, 1.0));
    }
    const auto update = update_pose(scene.prior, scene.matches, scene.map(), {});
    REQUIRE(update.converged);
    const PoseGaussian posterior = update.posterior;
    const Matrix6<double> covariance = NoiseScale::scaled(posterior.covariance, update.variance_ratio);
    mean_squares += truth.boxminus(posterior.pose).cwiseAbs2().cwiseQuotient(covariance.diagonal()) / kRuns;
  }
  CAPTURE(sigma_px.transpose(), mean_squares.transpose());
  CHECK(mean_squares.minCoeff() > 0.5);
  CHECK(mean_squares.maxCoeff() < 1.6);
}

TEST_CASE("Matches with large residuals are returned with the covariance that they were used with",
          "[stereo_slam][update]") {
  std::mt19937_64 random(11);
  test::MatchedScene scene = test::make_scene(random, test::car_motion(), 60, 0.001, 0.01);
  scene.matches.front().z.y() += 3.0 * test::kSceneSigma_px;
  const auto update = update_pose(scene.prior, scene.matches, scene.map(), {});
  REQUIRE(update.converged);
  REQUIRE(update.used.front().landmark == scene.matches.front().landmark);
  CHECK(update.used.front().R(1, 1) > 1.5 * scene.matches.front().R(1, 1));
  for (const auto& match : update.used) CHECK(match.R(0, 0) >= stereo_pixel_covariance(0.5)(0, 0));
}

TEST_CASE("Matches without residuals give finite results", "[stereo_slam][update]") {
  std::mt19937_64 random(9);
  const Pose truth = test::car_motion();
  test::MatchedScene scene = test::make_scene(random, truth, 30, 0.001, 0.01);
  for (auto& match : scene.matches) {
    const Landmark& landmark = scene.landmarks[match.landmark];
    match.z = project(to_point(landmark, landmark.mean, scene.camera), truth, scene.camera).value();
  }
  scene.prior.pose = truth;
  UpdateSettings settings;
  settings.student_t_inverse_dof = GENERATE(0.0, kDefaultInverseDof, 1.0);
  const auto update = update_pose(scene.prior, scene.matches, scene.map(), settings);
  REQUIRE(update.converged);
  CHECK(update.variance_ratio.allFinite());
  CHECK(update.variance_ratio.maxCoeff() < 1e-4);
  CHECK(update.posterior.covariance.allFinite());
  CHECK(truth.boxminus(update.posterior.pose).norm() < 1e-4);
}

}  // namespace
}  // namespace stereo_slam
