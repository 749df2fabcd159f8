// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/landmark_equations.hpp"

#include <random>

#include <Eigen/Cholesky>

#include "stereo_slam/support/matched_scene.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/tracking/pose_likelihood.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

using Sums = antipode::WeightedSums<double, 6, 0, antipode::TruncatedLoss<double>>;

/// A scene whose landmarks share up to a tenth of their errors with the prior.
test::MatchedScene correlated_scene(std::mt19937_64& random) {
  test::MatchedScene scene = test::make_scene(random, test::car_motion(), 12, 0.005, 0.1);
  std::uniform_real_distribution<double> uniform(-0.1, 0.1);
  const Matrix6<double> L = scene.prior.covariance.llt().matrixL();
  for (auto& landmark : scene.landmarks) {
    Matrix6x3 correlation;
    for (double& entry : correlation.reshaped()) entry = uniform(random);
    const Matrix3<double> L_landmark = landmark.covariance.llt().matrixL();
    landmark.pose_cross_covariance = L * correlation * L_landmark.transpose();
  }
  return scene;
}

TEST_CASE("The equations of landmarks have the cost of their likelihood, and its gradient",
          "[stereo_slam][update]") {
  const bool correlated = GENERATE(false, true);
  const double cap = GENERATE(16.0, 1e6);
  std::mt19937_64 random(11);
  const test::MatchedScene scene =
      correlated ? correlated_scene(random) : test::make_scene(random, test::car_motion(), 12, 0.005, 0.1);
  const WhitenedMatches matches = whiten(scene.matches, scene.map(), scene.prior);
  REQUIRE(matches.shared.has_value() == correlated);
  const LandmarkEquations equations{matches, {cap}};
  const PoseLikelihood likelihood(matches, cap);
  const auto cost = [&](const Pose& pose) { return 0.5 * likelihood.squared_distance(pose); };
  for (const double sigmas : {-1.0, 0.0, 0.5, 1.5}) {
    const Pose pose = scene.prior.pose.boxplus(sigmas * scene.prior.covariance.diagonal().cwiseSqrt());
    Sums sums(equations.noise);
    equations(pose, sums);
    CAPTURE(correlated, cap, sigmas);
    CHECK(sums.cost() == Approx(cost(pose)).epsilon(1e-10));
    for (int axis = 0; axis < 6; ++axis) {
      const double h = 1e-6;
      const double slope = (cost(pose.boxplus(h * Vector6<double>::Unit(axis))) -
                            cost(pose.boxplus(-h * Vector6<double>::Unit(axis)))) /
                           (2.0 * h);
      CHECK(sums.vector()[axis] == Approx(-slope).epsilon(1e-5).margin(1e-4 * sums.vector().norm()));
    }
  }
}

TEST_CASE("Landmarks behind the camera have no weight in the equations", "[stereo_slam][update]") {
  std::mt19937_64 random(12);
  const test::MatchedScene scene = test::make_scene(random, test::car_motion(), 20, 0.01, 0.1);
  const WhitenedMatches matches = whiten(scene.matches, scene.map());
  const LandmarkEquations equations{matches, {16.0}};
  Vector6<double> far_ahead = Vector6<double>::Zero();
  far_ahead[5] = 100.0;
  Sums sums(equations.noise);
  equations(Pose::exp(far_ahead), sums);
  CHECK(sums.cost() == Approx(20 * 8.0));
  CHECK(sums.measurements() == 0);
  CHECK(sums.information().isZero(0.0));
}

}  // namespace
}  // namespace stereo_slam
