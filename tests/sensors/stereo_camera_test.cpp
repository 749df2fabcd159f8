// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include <antipode/distributions/pose_gaussian_queries.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/unscented_update.hpp>
#include <antipode/sensors/inverse_depth_landmark.hpp>
#include <antipode/sensors/stereo_camera.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"
#include "support/reference.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;

const StereoCamera<double> kCamera{718.856, 718.856, 607.1928, 185.2157, 0.53715};

/// A point in front of the camera at a pose, 3 to 300 m away, and its measurement.
Vector3<double> random_measurement(Rng& rng) {
  const double depth = std::exp(uniform<double>(rng, std::log(3.0), std::log(300.0)));
  return {uniform<double>(rng, 0, 1241), uniform<double>(rng, 0, 376),
          kCamera.fx * kCamera.baseline_m / depth};
}

}  // namespace

TEST_CASE("A point is measured where the hand-made projection says", "[sensors]") {
  const StereoCamera<double> camera{100, 200, 50, 60, 0.5};
  const auto z = camera.project(Vector3<double>(1, 2, 4));
  REQUIRE(z);
  CHECK(max_difference(*z, Vector3<double>(75, 160, 12.5)) == 0.0);
  // One metre ahead and a quarter turn to the right: x of the camera is -z of the world.
  const double h = std::sqrt(0.5);
  const Pose T = Pose::from_rotation_translation(Vector4<double>(h, 0, h, 0), Vector3<double>(0, 0, 1));
  const auto seen = camera.project(T, {Vector3<double>(4, 2, 0), 1.0});
  REQUIRE(seen);
  CHECK(max_difference(*seen, *z) <= 1e-12);
}

TEST_CASE("Back-projected measurements are measured again, at infinity too", "[sensors][law]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto T = random_pose<double>(rng);
    Vector3<double> z = random_measurement(rng);
    if (seed % 4 == 0) z[2] = 0.0;
    const InverseDepthLandmark<double> landmark{T, z, Matrix3<double>::Identity()};
    const auto again = landmark.project(kCamera, T, z);
    REQUIRE(again);
    CHECK(max_difference(*again, z) <= 1e-9);
    // The same point in Euclidean coordinates, from elsewhere.
    const auto elsewhere = T.boxplus(random_twist<double>(rng, 0.1, 0.3));
    const auto [x, w] = landmark.point(kCamera, z);
    if (w == 0.0) continue;
    const auto expected = kCamera.project(Vector3<double>(elsewhere.inverse() * Vector3<double>(x / w)));
    const auto seen = landmark.project(kCamera, elsewhere, z);
    REQUIRE(expected.has_value() == seen.has_value());
    if (seen) CHECK(max_difference(*seen, *expected) <= 1e-8);
  }
}

TEST_CASE("Jacobians of the projection are its derivatives", "[sensors]") {
  constexpr double kStep = 1e-6;
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto T = random_pose<double>(rng);
    const InverseDepthLandmark<double> landmark{T, random_measurement(rng), Matrix3<double>::Identity()};
    const auto T_camera = T.boxplus(random_twist<double>(rng, 0.05, 0.3));
    const auto point = landmark.point(kCamera, landmark.mean);
    const auto J = kCamera.projection_jacobians(T_camera, point);
    REQUIRE(kCamera.project(T_camera, point));
    for (int i = 0; i < 6; ++i) {
      const Vector6<double> xi = kStep * Vector6<double>::Unit(i);
      const Vector3<double> derivative = (*kCamera.project(T_camera.boxplus(xi), point) -
                                          *kCamera.project(T_camera.boxplus(Vector6<double>(-xi)), point)) /
                                         (2.0 * kStep);
      CHECK((derivative - J.pose.col(i)).norm() <= 1e-5 * (1.0 + derivative.norm()));
    }
    const Matrix3<double> J_landmark = J.point * landmark.point_jacobian(kCamera);
    for (int i = 0; i < 3; ++i) {
      const Vector3<double> d = 1e-4 * Vector3<double>::Unit(i);
      const Vector3<double> derivative =
          (*landmark.project(kCamera, T_camera, Vector3<double>(landmark.mean + d)) -
           *landmark.project(kCamera, T_camera, Vector3<double>(landmark.mean - d))) /
          2e-4;
      CHECK((derivative - J_landmark.col(i)).norm() <= 1e-5 * (1.0 + derivative.norm()));
    }
    // From where it was first seen, the landmark is its own measurement.
    const auto same = landmark.seen_from(kCamera, T);
    REQUIRE(same);
    CHECK(max_difference(same->covariance, landmark.covariance) <= 1e-9);
  }
}

TEST_CASE("What is behind or too near is not measured", "[sensors]") {
  CHECK_FALSE(kCamera.project(Vector3<double>(0, 0, -1)));
  CHECK_FALSE(kCamera.project(Vector3<double>(0, 0, 0.1)));
  CHECK_FALSE(kCamera.project(Vector3<double>(0, 0, std::numeric_limits<double>::quiet_NaN())));
  CHECK_FALSE(kCamera.project(Pose(), {Vector3<double>(0, 0, -1), 0.0}));
  CHECK(kCamera.project(Pose(), {Vector3<double>(0, 0, 1), 0.0}));
  CHECK(contains(error_message([] {
                   StereoCamera<double>{700, 700, 0, 0, 0}.check();
                 }),
                 "not positive and finite: [700; 700; 0]"));
  for (const double depth_m : {-0.1, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK_THROWS_AS((StereoCamera<double>{700, 700, 0, 0, 0.5, depth_m}.check()), std::invalid_argument);
  }
  kCamera.check();
}

TEST_CASE("A landmark with one triangle of its covariance is refused", "[sensors][error]") {
  const StereoCamera<double> camera{700, 700, 320, 240, 0.5};
  InverseDepthLandmark<double> landmark{Pose(), Vector3<double>(300, 250, 35), Matrix3<double>::Identity()};
  CHECK(landmark.seen_from(camera, Pose()).has_value());
  landmark.covariance(0, 2) = 0.5;
  CHECK(contains(error_message([&] { (void)landmark.seen_from(camera, Pose()); }), "[1, 0, 0.5; 0, 1, 0;"));
}

TEST_CASE("Landmarks of inverse depth localise a camera, with a covariance as large as the error",
          "[sensors][random]") {
  // The measurement of the paper: landmarks seen once from the keyframe, then from the camera.
  constexpr int kRuns = 60, kLandmarks = 30;
  const Matrix3<double> R = stereo_pixel_covariance(0.5);
  const Matrix3<double> root = detail::cholesky_factor<double, 3>(R).value();
  const PoseGaussian<double> prior{Pose(), 1e-3 * Matrix6<double>::Identity()};
  double sum = 0.0;
  for (unsigned run = 0; run < kRuns; ++run) {
    Rng rng(run);
    const auto truth = sample(prior, rng);
    std::vector<InverseDepthLandmark<double>> landmarks;
    std::vector<NoisyMeasurement<double, 3>> seen;
    while (landmarks.size() < kLandmarks) {
      const Vector3<double> z = random_measurement(rng);
      const InverseDepthLandmark<double> landmark{Pose(), z + root * detail::standard_normal<double, 3>(rng),
                                                  R};
      const auto exact = landmark.project(kCamera, truth, z);
      const auto predicted = landmark.seen_from(kCamera, truth);
      if (!exact || !predicted) continue;
      landmarks.push_back(landmark);
      seen.push_back({*exact + root * detail::standard_normal<double, 3>(rng), predicted->covariance + R});
    }
    const auto update = quadratic_update(prior, [&](const Pose& x) {
      double log_likelihood = 0.0;
      for (std::size_t i = 0; i < landmarks.size(); ++i) {
        const auto z = landmarks[i].project(kCamera, x, landmarks[i].mean);
        if (!z) return -std::numeric_limits<double>::infinity();
        log_likelihood -= 0.5 * (seen[i].z - *z).dot(seen[i].R.inverse() * (seen[i].z - *z));
      }
      return log_likelihood;
    });
    REQUIRE(update.status == UpdateStatus::kConverged);
    sum += nees(update.posterior, truth) / kRuns;
    // Seen again, the landmark itself is known better (DQV-SLAM Alg. 4).
    const auto again = unscented_update(
        Gaussian<double, 3>(landmarks[0].mean, landmarks[0].covariance), truth,
        [&](const Pose& x, const Vector3<double>& l) { return landmarks[0].project(kCamera, x, l); },
        NoisyMeasurement<double, 3>{seen[0].z, R});
    CHECK(again.posterior.covariance().trace() < 0.9 * R.trace());
  }
  CHECK(std::abs(sum - 6.0) <= 4.0 * std::sqrt(12.0 / kRuns));
}
