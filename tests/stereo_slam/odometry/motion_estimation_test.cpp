// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/motion_estimation.hpp"

#include <Eigen/Cholesky>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr double kSigma_px = 0.3;

/// Both measurements of random points seen before and after `motion`, with noise.
std::vector<StereoCorrespondence> correspondences(std::mt19937_64& random, int count, const Pose& motion,
                                                  double sigma_px, double near_m = 5.0, double far_m = 60.0) {
  const StereoCamera camera = test::kitti_camera();
  std::vector<StereoCorrespondence> result;
  while (static_cast<int>(result.size()) < count) {
    const StereoPoint previous = test::random_measurement(random, camera, near_m, far_m);
    const auto current = camera.project(motion.inverse() * camera.back_project(previous));
    if (!current || !camera.in_view(*current)) continue;
    result.push_back(
        {previous + test::stereo_noise(random, sigma_px), *current + test::stereo_noise(random, sigma_px)});
  }
  return result;
}

OdometrySettings odometry_settings() {
  OdometrySettings result;
  result.pixel_sigma_px = kSigma_px;
  return result;
}

TEST_CASE("The motion of exact correspondences is found exactly, from any nearby start",
          "[stereo_slam][odometry]") {
  std::mt19937_64 random(3);
  const Pose motion = test::car_motion();
  const auto matches = correspondences(random, 80, motion, 0.0);
  const auto estimate =
      estimate_motion(matches, test::kitti_camera(), {Pose::identity()}, odometry_settings(), random);
  REQUIRE(estimate.valid);
  CHECK(estimate.T_previous_current.pose.boxminus(motion).norm() < 1e-9);
  CHECK(estimate.inlier_count == 80);
}

TEST_CASE("The motion survives half of the correspondences being wrong", "[stereo_slam][odometry]") {
  std::mt19937_64 random(4);
  const Pose motion = test::car_motion();
  auto matches = correspondences(random, 200, motion, kSigma_px);
  for (std::size_t i = 0; i < matches.size(); i += 2) {
    matches[i].current = test::random_measurement(random, test::kitti_camera(), 5.0, 60.0);
  }
  const auto estimate =
      estimate_motion(matches, test::kitti_camera(), {Pose::identity()}, odometry_settings(), random);
  REQUIRE(estimate.valid);
  const Vector6<double> error = motion.boxminus(estimate.T_previous_current.pose);
  CHECK(error.head<3>().norm() < 1e-3);
  CHECK(error.tail<3>().norm() < 0.03);
  CHECK(estimate.inlier_count >= 95);
  CHECK(estimate.inlier_count <= 110);
}

TEST_CASE("Static points outvote a lorry that fills the image, and have no other weight",
          "[stereo_slam][odometry]") {
  std::mt19937_64 random(14);
  const Pose motion = test::car_motion();
  auto matches = correspondences(random, 60, motion, kSigma_px);
  const auto on_lorry = correspondences(random, 120, Pose::identity(), kSigma_px);  // as fast as the camera
  matches.insert(matches.end(), on_lorry.begin(), on_lorry.end());
  const auto static_points = correspondences(random, 100, motion, kSigma_px);
  const auto estimate =
      estimate_motion(matches, test::kitti_camera(), {motion}, odometry_settings(), random, static_points);
  REQUIRE(estimate.valid);
  CHECK(motion.boxminus(estimate.T_previous_current.pose).tail<3>().norm() < 0.05);
  CHECK(estimate.is_inlier.size() == matches.size());
  const auto alone =
      estimate_motion({matches.data(), 60}, test::kitti_camera(), {motion}, odometry_settings(), random);
  CHECK(estimate.T_previous_current.covariance(5, 5) > 0.3 * alone.T_previous_current.covariance(5, 5));

  const auto fooled =
      estimate_motion(matches, test::kitti_camera(), {Pose::identity()}, odometry_settings(), random);
  CHECK(fooled.T_previous_current.pose.translation().norm() < 0.1);
}

TEST_CASE("Far points agree with any motion but do not hold back the first one", "[stereo_slam][odometry]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    const Pose motion = test::car_motion(2.5);
    auto matches = correspondences(random, 60, motion, kSigma_px, 6.0, 40.0);
    const auto far = correspondences(random, 120, motion, kSigma_px, 100.0, 400.0);
    matches.insert(matches.end(), far.begin(), far.end());
    const auto estimate =
        estimate_motion(matches, test::kitti_camera(), {Pose::identity()}, odometry_settings(), random);
    REQUIRE(estimate.valid);
    CHECK(motion.boxminus(estimate.T_previous_current.pose).tail<3>().norm() < 0.1);
  }
}

/// What is expected after steps whose motions changed by about these.
ExpectedMotion expected_from_steady(const Pose& motion) { return {motion, 0.006, 0.02}; }

TEST_CASE("Of two motions that many points agree on, the one that continues the last motion is found",
          "[stereo_slam][odometry]") {
  std::mt19937_64 random(15);
  const Pose motion = test::car_motion();
  Vector6<double> faster = Vector6<double>::Zero();
  faster[5] = 0.02;
  const ExpectedMotion expected = expected_from_steady(motion.boxplus(faster));
  auto matches = correspondences(random, 80, motion, kSigma_px);
  const auto on_lorry = correspondences(random, 95, Pose::identity(), kSigma_px);
  matches.insert(matches.end(), on_lorry.begin(), on_lorry.end());
  const auto estimate = estimate_motion(matches, test::kitti_camera(), expected, odometry_settings(), random);
  REQUIRE(estimate.valid);
  CHECK_FALSE(estimate.surprising);
  CHECK(motion.boxminus(estimate.T_previous_current.pose).tail<3>().norm() < 0.05);

  // A jump that nearly all points agree on is real.
  const auto jump = correspondences(random, 120, test::car_motion(-2.0), kSigma_px);
  const auto after_jump = estimate_motion(jump, test::kitti_camera(), expected, odometry_settings(), random);
  REQUIRE(after_jump.valid);
  CHECK(after_jump.surprising);
  CHECK(after_jump.T_previous_current.pose.boxminus(test::car_motion(-2.0)).tail<3>().norm() < 0.05);
}

TEST_CASE("Against a steady motion a few points prove no surprise; where nothing is known a majority counts",
          "[stereo_slam][odometry]") {
  const Pose motion = test::car_motion();
  const Pose of_lorry = test::car_motion(-0.2);
  const auto found = [&](int on_street, int on_lorry, const ExpectedMotion& expected) {
    std::mt19937_64 random(16);
    auto matches = correspondences(random, on_street, motion, kSigma_px, 5.0, 30.0);
    const auto moving = correspondences(random, on_lorry, of_lorry, kSigma_px, 5.0, 30.0);
    matches.insert(matches.end(), moving.begin(), moving.end());
    return estimate_motion(matches, test::kitti_camera(), expected, odometry_settings(), random);
  };
  const auto is_lorrys = [&](const MotionEstimate& estimate) {
    return estimate.valid && of_lorry.boxminus(estimate.T_previous_current.pose).tail<3>().norm() < 0.1;
  };
  const auto steady = found(2, 18, expected_from_steady(motion));
  CHECK_FALSE(steady.valid);  // nothing is measured, instead of the lorry's motion
  CHECK_FALSE(steady.surprising);
  CHECK(is_lorrys(found(2, 18, {motion})));
  CHECK_FALSE(found(2, 18, {motion}).surprising);  // nothing was expected
  CHECK(is_lorrys(found(2, 60, expected_from_steady(motion))));
  CHECK(found(2, 60, expected_from_steady(motion)).surprising);

  // The lorry's motion was taken for the camera's. After that surprise the expected motion is uncertain, and
  // the street wins with the first majority.
  CHECK(is_lorrys(found(50, 30, expected_from_steady(of_lorry))));
  const auto corrected = found(50, 30, {of_lorry, 0.006, 0.5});
  CHECK(motion.boxminus(corrected.T_previous_current.pose).tail<3>().norm() < 0.1);
}

TEST_CASE("Points that were static for long outvote more new points", "[stereo_slam][odometry]") {
  const Pose motion = test::car_motion();
  const auto translation_error_m = [&](double static_evidence) {
    std::mt19937_64 random(17);
    auto matches = correspondences(random, 30, motion, kSigma_px, 5.0, 30.0);
    for (auto& match : matches) match.static_evidence = static_evidence;
    const auto moving = correspondences(random, 60, test::car_motion(-0.2), kSigma_px, 5.0, 30.0);
    matches.insert(matches.end(), moving.begin(), moving.end());
    const auto estimate =
        estimate_motion(matches, test::kitti_camera(), {motion}, odometry_settings(), random);
    return motion.boxminus(estimate.T_previous_current.pose).tail<3>().norm();
  };
  CHECK(translation_error_m(1.0) > 0.5);
  CHECK(translation_error_m(3.0) < 0.1);
}

TEST_CASE("The reported covariance of the motion is consistent with its errors", "[stereo_slam][odometry]") {
  constexpr int kRuns = 100;
  std::mt19937_64 random(5);
  const Pose motion = test::car_motion();
  double nees = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const auto matches = correspondences(random, 150, motion, kSigma_px);
    const auto estimate =
        estimate_motion(matches, test::kitti_camera(), {motion}, odometry_settings(), random);
    REQUIRE(estimate.valid);
    const Vector6<double> error = motion.boxminus(estimate.T_previous_current.pose);
    nees += error.dot(estimate.T_previous_current.covariance.ldlt().solve(error));
  }
  nees /= kRuns;
  CAPTURE(nees);
  // 95 % band of the mean of 100 chi-squares with 6 degrees of freedom is [5.34, 6.70]; the Cauchy weights
  // cost a few per cent of the information, the variance factor from the median adds its own noise.
  CHECK(nees > 4.7);
  CHECK(nees < 7.3);
}

TEST_CASE("Far points do not make the motion too long", "[stereo_slam][odometry]") {
  constexpr int kRuns = 60;
  std::mt19937_64 random(6);
  const Pose motion = test::car_motion(1.2);
  double forward = 0.0;
  double variance = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const auto matches = correspondences(random, 300, motion, kSigma_px, 30.0, 150.0);
    const auto estimate =
        estimate_motion(matches, test::kitti_camera(), {motion}, odometry_settings(), random);
    REQUIRE(estimate.valid);
    forward += motion.boxminus(estimate.T_previous_current.pose)[5] / kRuns;
    variance += estimate.T_previous_current.covariance(5, 5) / (kRuns * kRuns);
  }
  CAPTURE(forward, std::sqrt(variance));
  CHECK(std::abs(forward) < 4.0 * std::sqrt(variance));
}

TEST_CASE("Too few correspondences, or none, give no motion", "[stereo_slam][odometry]") {
  std::mt19937_64 random(7);
  const Pose start = test::car_motion();
  for (const int count : {0, 2, 11}) {
    const auto matches = correspondences(random, count, start, kSigma_px);
    const auto estimate =
        estimate_motion(matches, test::kitti_camera(), {start}, odometry_settings(), random);
    CHECK_FALSE(estimate.valid);
    CHECK(estimate.T_previous_current.pose.is_approx(start, 1e-15));
  }
}

TEST_CASE("Correspondences of nothing but noise give no confident motion", "[stereo_slam][odometry]") {
  std::mt19937_64 random(8);
  std::vector<StereoCorrespondence> matches;
  matches.reserve(100);
  for (int i = 0; i < 100; ++i) {
    matches.push_back({test::random_measurement(random, test::kitti_camera(), 5.0, 60.0),
                       test::random_measurement(random, test::kitti_camera(), 5.0, 60.0)});
  }
  const auto estimate =
      estimate_motion(matches, test::kitti_camera(), {Pose::identity()}, odometry_settings(), random);
  CHECK_FALSE(estimate.valid);
}

TEST_CASE("A motion is valid only if its covariance can be a density of poses", "[stereo_slam][odometry]") {
  OdometrySettings lenient = odometry_settings();
  lenient.min_inliers = 3;
  const Pose motion = test::car_motion();
  const StereoCamera camera = test::kitti_camera();
  int valid = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    // A few points in a spot of the image leave some motions, or all, nearly free.
    const double spread_px = std::pow(10.0, -2.0 + 4.0 * uniform(random));
    const double sigma_px = std::pow(10.0, -3.0 + 3.0 * uniform(random));
    const StereoPoint centre(300.0, 200.0, 0.5 + 40.0 * uniform(random));
    std::vector<StereoCorrespondence> matches;
    while (matches.size() < 3 + seed % 4) {
      const StereoPoint previous = centre + test::stereo_noise(random, spread_px);
      if (previous.z() < 0.1) continue;
      const auto current = camera.project(motion.inverse() * camera.back_project(previous));
      if (current) matches.push_back({previous, *current + test::stereo_noise(random, sigma_px)});
    }
    const auto estimate = estimate_motion(matches, camera, {motion}, lenient, random);
    if (!estimate.valid) continue;
    ++valid;
    CHECK_NOTHROW(PoseDensity::from_pose_covariance(estimate.T_previous_current.pose,
                                                    estimate.T_previous_current.covariance));
  }
  CHECK(valid > 100);
}

TEST_CASE("The same seed gives the same motion, bit for bit", "[stereo_slam][odometry]") {
  std::mt19937_64 random(9);
  const auto matches = correspondences(random, 120, test::car_motion(), kSigma_px);
  std::mt19937_64 first(1);
  std::mt19937_64 second(1);
  const auto a =
      estimate_motion(matches, test::kitti_camera(), {Pose::identity()}, odometry_settings(), first);
  const auto b =
      estimate_motion(matches, test::kitti_camera(), {Pose::identity()}, odometry_settings(), second);
  CHECK(a.T_previous_current.pose.coeffs() == b.T_previous_current.pose.coeffs());
  CHECK(a.T_previous_current.covariance == b.T_previous_current.covariance);
}

}  // namespace
}  // namespace stereo_slam
