// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/two_view_adjustment.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Cholesky>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// Images of .4 of KITTI's size. A change of height and one of pitch look alike on a distant facade.
const StereoCamera kSmallCamera{288.0, 288.0, 248.0, 75.0, 0.5371657, 496, 150};
constexpr double kAssumedSigma_px = 1.0;
constexpr double kChi2_6_9999 = 27.86;

TwoViewAdjustment adjustment_of(const std::vector<StereoCorrespondence>& correspondences,
                                const Pose& initial) {
  return TwoViewAdjustment(correspondences, kSmallCamera, initial, kAssumedSigma_px);
}

std::vector<StereoCorrespondence> facade(std::uint64_t seed, const Pose& T_previous_current) {
  constexpr std::size_t kPoints = 100;
  std::mt19937_64 random(seed);
  std::vector<StereoCorrespondence> correspondences;
  while (correspondences.size() < kPoints) {
    const StereoPoint z = test::random_measurement(random, kSmallCamera, 18.0, 22.0);
    const auto z_current = kSmallCamera.project(T_previous_current.inverse() * kSmallCamera.back_project(z));
    if (!z_current) continue;
    correspondences.push_back(
        {z + test::stereo_noise(random, 0.5), *z_current + test::stereo_noise(random, 0.5)});
  }
  return correspondences;
}

TEST_CASE("The adjustment stays at the minimum where the points hardly determine the motion",
          "[stereo_slam][odometry]") {
  Vector6<double> xi;
  xi << 0.0, 0.0, 0.0, 0.01, -0.01, 1.8;
  const Pose T_previous_current = Pose::exp(xi);
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    CAPTURE(seed);
    const auto correspondences = facade(seed, T_previous_current);
    const std::vector<std::uint8_t> all(correspondences.size(), 1);
    Vector6<double> pitch_and_height;
    pitch_and_height << 0.01, 0.0, 0.0, 0.0, -0.2, 0.0;
    for (const double distance : {0.0, 1.0, -1.0}) {
      CAPTURE(distance);
      const Pose initial = T_previous_current.boxplus(distance * pitch_and_height);
      const auto found = adjustment_of(correspondences, initial).solve(initial, all);
      REQUIRE(found);
      const Vector6<double> error = found->pose.boxminus(T_previous_current);
      CHECK(error.dot(found->covariance.ldlt().solve(error)) < kChi2_6_9999);
    }
  }
}

/// The share of the true path that the adjustment measures over a plane, as a drone with a small baseline
/// sees the ground, and its standard deviation.
struct MeasuredShare {
  double mean = 0.0;
  double sigma = 0.0;
};

MeasuredShare share_of_path_over_plane(double disparity_px, double noise_px) {
  const StereoCamera camera{450.0, 450.0, 376.0, 240.0, 0.1, 752, 480};
  const double height_m = camera.fx * camera.baseline_m / disparity_px;
  Vector6<double> xi = Vector6<double>::Zero();
  xi[4] = -height_m / 60.0;  // 7.5 px of flow
  const Pose T_previous_current = Pose::exp(xi);
  constexpr int kTrials = 30;
  constexpr std::size_t kPoints = 300;
  double sum = 0.0, sum_of_squares = 0.0;
  for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
    std::mt19937_64 random(seed);
    std::vector<StereoCorrespondence> correspondences;
    while (correspondences.size() < kPoints) {
      const StereoPoint z = test::random_measurement(random, camera, height_m, height_m + 1e-9);
      const auto z_current = camera.project(T_previous_current.inverse() * camera.back_project(z));
      const StereoPoint first = z + test::stereo_noise(random, noise_px);
      if (!z_current || !(first.z() > 0.0)) continue;
      correspondences.push_back({first, *z_current + test::stereo_noise(random, noise_px)});
    }
    const std::vector<std::uint8_t> all(correspondences.size(), 1);
    const auto found =
        TwoViewAdjustment(correspondences, camera, Pose::identity(), noise_px).solve(Pose::identity(), all);
    REQUIRE(found);
    const double share = found->pose.translation().norm() / T_previous_current.translation().norm();
    sum += share;
    sum_of_squares += share * share;
  }
  const double mean = sum / kTrials;
  return {mean, std::sqrt((sum_of_squares / kTrials - mean * mean) / kTrials)};
}

TEST_CASE("The motion over ground whose disparities are a few times their noise is not too short",
          "[stereo_slam][odometry]") {
  // Disparities have sqrt(2) times the noise of a coordinate. Least squares for the innovations would measure
  // 1 / (1 + (noise / disparity)^2) of the path: .96 and .99.
  for (const double noise_px : {0.1, 0.05}) {
    CAPTURE(noise_px);
    const auto share = share_of_path_over_plane(0.75, noise_px);
    CAPTURE(share.mean, share.sigma);
    CHECK(std::abs(share.mean - 1.0) < 4.0 * share.sigma + 0.002);
  }
}

TEST_CASE("The adjustment of points behind the camera, or of none, gives nothing",
          "[stereo_slam][odometry]") {
  const auto correspondences = facade(1, Pose::identity());
  const std::vector<std::uint8_t> all(correspondences.size(), 1);
  const std::vector<std::uint8_t> none(correspondences.size(), 0);
  CHECK_FALSE(adjustment_of(correspondences, Pose::identity()).solve(Pose::identity(), none));
  Vector6<double> xi = Vector6<double>::Zero();
  xi[5] = 100.0;
  const Pose beyond = Pose::exp(xi);
  CHECK_FALSE(adjustment_of(correspondences, beyond).solve(beyond, all));
  CHECK_FALSE(adjustment_of({}, Pose::identity()).solve(Pose::identity(), {}));
}

}  // namespace
}  // namespace stereo_slam
