// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/two_view_adjustment.hpp"

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
  return TwoViewAdjustment(correspondences, kSmallCamera, initial, [](const StereoCorrespondence&) {
    return stereo_pixel_covariance(kAssumedSigma_px);
  });
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
