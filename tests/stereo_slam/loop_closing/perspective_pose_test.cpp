// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/perspective_pose.hpp"

#include <limits>
#include <vector>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr int kFewestInliers = 13;
const StereoCamera kPerspectiveCamera = test::kitti_camera();

Pose turned_motion() {
  Vector6<double> xi;
  xi << 0.05, -0.2, 0.02, 1.0, -0.2, 3.0;
  return Pose::exp(xi);
}

/// `right` correspondences with noise, and `wrong` ones of unrelated points.
std::vector<StereoCorrespondence> with_outliers(std::uint64_t seed, std::size_t right, std::size_t wrong,
                                                double near_m = 6.0, double far_m = 50.0) {
  std::mt19937_64 random(seed);
  std::vector<StereoCorrespondence> result;
  while (result.size() < right) {
    const StereoPoint z = test::random_measurement(random, kPerspectiveCamera, near_m, far_m);
    const auto z_current =
        kPerspectiveCamera.project(turned_motion().inverse() * kPerspectiveCamera.back_project(z));
    if (!z_current || !kPerspectiveCamera.in_view(*z_current)) continue;
    result.push_back({z + test::stereo_noise(random, 0.5), *z_current + test::stereo_noise(random, 0.5)});
  }
  for (std::size_t i = 0; i < wrong; ++i) {
    result.push_back({test::random_measurement(random, kPerspectiveCamera, near_m, far_m),
                      test::random_measurement(random, kPerspectiveCamera, near_m, far_m)});
  }
  return result;
}

std::optional<Pose> pose_of(const std::vector<StereoCorrespondence>& correspondences,
                            std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  return perspective_pose(correspondences, kFewestInliers, kPerspectiveCamera, LoopVerificationSettings{},
                          random);
}

TEST_CASE("A pose is found although three in four correspondences are wrong, from all of the others",
          "[stereo_slam][loops]") {
  constexpr int kRuns = 40;
  double mean_rotation = 0.0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    CAPTURE(seed);
    const auto pose = pose_of(with_outliers(seed, 20, 60), seed);
    REQUIRE(pose);
    const Vector6<double> error = pose->boxminus(turned_motion());
    CHECK(error.head<3>().norm() < 0.02);
    CHECK(error.tail<3>().norm() < 0.5);
    mean_rotation += error.head<3>().norm() / kRuns;
  }
  CHECK(mean_rotation < 0.002);  // .0012; from the best three points alone .003
}

TEST_CASE("Of the two poses that agree with a distant plane the right one is found", "[stereo_slam][loops]") {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    CAPTURE(seed);
    const auto pose = pose_of(with_outliers(seed, 60, 10, 39.0, 40.0), seed);
    REQUIRE(pose);
    CHECK(pose->boxminus(turned_motion()).head<3>().norm() < 0.05);
  }
}

TEST_CASE("Points that agree with a pose in the image, but not in disparity, do not vote for it",
          "[stereo_slam][loops]") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    auto correspondences = with_outliers(seed, 20, 0);
    std::mt19937_64 random(seed);
    const Pose other = test::car_motion(2.0);
    while (correspondences.size() < 60) {
      const StereoPoint z = test::random_measurement(random, kPerspectiveCamera, 6.0, 20.0);
      auto z_current = kPerspectiveCamera.project(other.inverse() * kPerspectiveCamera.back_project(z));
      if (!z_current || !kPerspectiveCamera.in_view(*z_current)) continue;
      z_current->z() *= correspondences.size() % 2 == 0 ? 1.4 : 0.6;
      correspondences.push_back({z, *z_current});
    }
    const auto pose = pose_of(correspondences, seed);
    REQUIRE(pose);
    CHECK(pose->boxminus(turned_motion()).head<3>().norm() < 0.02);
  }
}

TEST_CASE("Correspondences that determine no pose give nothing, or a pose of finite numbers",
          "[stereo_slam][loops]") {
  const auto good = with_outliers(1, 30, 0);
  CHECK_FALSE(pose_of({}));
  CHECK_FALSE(pose_of({good.begin(), good.begin() + 3}));
  const std::vector<StereoCorrespondence> same(30, good.front());
  std::vector<StereoCorrespondence> in_line;
  for (int i = 0; i < 30; ++i) {
    const StereoPoint z(100.0 + 10.0 * i, 180.0, 20.0);
    in_line.push_back({z, z});
  }
  for (const auto& correspondences : {same, in_line}) {
    const auto pose = pose_of(correspondences);
    if (pose) CHECK(pose->coeffs().allFinite());
  }
  for (const double disparity :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    CAPTURE(disparity);
    auto broken = good;
    for (std::size_t i = 0; i < 10; ++i) broken[i].previous.z() = disparity;
    for (std::size_t i = 5; i < 15; ++i) broken[i].current.z() = disparity;
    const auto pose = pose_of(broken);
    REQUIRE(pose);
    CHECK(pose->boxminus(turned_motion()).head<3>().norm() < 0.02);
  }
}

TEST_CASE("The same correspondences and seed give the same bits", "[stereo_slam][loops]") {
  const auto correspondences = with_outliers(7, 30, 60);
  const auto pose = pose_of(correspondences, 5);
  REQUIRE(pose);
  CHECK(pose->coeffs() == pose_of(correspondences, 5)->coeffs());
}

}  // namespace
}  // namespace stereo_slam
