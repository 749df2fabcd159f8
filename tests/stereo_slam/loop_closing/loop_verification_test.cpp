// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/loop_verification.hpp"

#include <random>

#include <Eigen/Cholesky>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr double kSigma_px = 0.8;

const StereoCamera kCamera = test::kitti_camera();
const LoopVerificationSettings kSettings{};

Descriptor random_descriptor(std::mt19937_64& random) {
  Descriptor descriptor{};
  for (auto& byte : descriptor) byte = static_cast<std::uint8_t>(random());
  return descriptor;
}

/// A street seen from two poses. Some points of the new keyframe are points of the old one, with noise and
/// changed descriptors; the others are different, and some of them look like old points.
struct Revisit {
  Keyframe old_keyframe;
  Keyframe new_keyframe;
  Pose T_old_new;

  Revisit(std::uint64_t seed, std::size_t common, std::size_t lookalikes = 40, std::size_t others = 200) {
    std::mt19937_64 random(seed);
    Vector6<double> xi;
    xi << 0.02, -0.1, 0.01, 0.6, -0.1, 1.2;
    T_old_new = Pose::exp(xi);
    old_keyframe.id = 3;
    new_keyframe.id = 90;
    while (new_keyframe.points.size() < common) {
      const auto z_old = test::random_measurement(random, kCamera, 6.0, 60.0);
      const auto z_new = kCamera.project(T_old_new.inverse() * kCamera.back_project(z_old));
      if (!z_new || !kCamera.in_view(*z_new)) continue;
      const auto descriptor = random_descriptor(random);
      add(old_keyframe, z_old + test::stereo_noise(random, kSigma_px), descriptor);
      add(new_keyframe, *z_new + test::stereo_noise(random, kSigma_px), worn(descriptor, random));
    }
    for (std::size_t i = 0; i < others; ++i) {
      const auto descriptor = random_descriptor(random);
      add(old_keyframe, test::random_measurement(random, kCamera, 6.0, 60.0), descriptor);
      add(new_keyframe, test::random_measurement(random, kCamera, 6.0, 60.0),
          i < lookalikes ? worn(descriptor, random) : random_descriptor(random));
    }
  }

  static void add(Keyframe& keyframe, const StereoPoint& z, const Descriptor& descriptor) {
    keyframe.points.push_back({z.cast<float>(), descriptor});
  }
  static Descriptor worn(Descriptor descriptor, std::mt19937_64& random) {
    for (int flip = 0; flip < 25; ++flip) {
      descriptor[random() % 32] ^= static_cast<std::uint8_t>(1U << (random() % 8));
    }
    return descriptor;
  }

  [[nodiscard]] std::optional<LoopMeasurement> verify() const {
    return verify_loop(old_keyframe, new_keyframe, kCamera, kSettings, 1);
  }
};

TEST_CASE("A revisit among lookalikes is measured, with a consistent covariance", "[stereo_slam][loops]") {
  constexpr int kRuns = 60;
  double nees = 0.0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    CAPTURE(seed);
    const Revisit revisit(seed, 80);
    const auto result = revisit.verify();
    REQUIRE(result);
    CHECK(result->old_keyframe == 3);
    CHECK(result->new_keyframe == 90);
    CHECK(result->inliers >= 65);
    CHECK(result->inliers <= 90);
    const Vector6<double> e = revisit.T_old_new.boxminus(result->T_old_new.pose);
    CHECK(e.tail<3>().norm() < 0.25);
    CHECK(e.head<3>().norm() < 0.01);
    nees += e.dot(result->T_old_new.covariance.ldlt().solve(e)) / kRuns;
  }
  CHECK(nees > 4.5);  // 6 for the exact covariance; a robust one from a few dozen residuals scatters
  CHECK(nees < 9.0);
}

TEST_CASE("Lookalikes without a common pose make no loop", "[stereo_slam][loops]") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    CHECK_FALSE(Revisit(seed, 0, 150).verify());
    CHECK_FALSE(Revisit(seed, 15, 60).verify());
  }
  CHECK_FALSE(Revisit(1, 0, 0).verify());
}

TEST_CASE("Verification of empty keyframes fails; the same keyframes give the same bits",
          "[stereo_slam][loops]") {
  CHECK_FALSE(verify_loop({}, {}, kCamera, kSettings, 1));
  const Revisit revisit(5, 60);
  const auto first = revisit.verify();
  const auto second = revisit.verify();
  REQUIRE(first);
  REQUIRE(second);
  CHECK(first->T_old_new.pose.coeffs() == second->T_old_new.pose.coeffs());
  CHECK(first->T_old_new.covariance == second->T_old_new.covariance);
}

/// Keyframes that drive straight on, one metre each.
std::vector<Keyframe> straight_drive(std::size_t keyframes) {
  Vector6<double> xi;
  xi << 0.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  Keyframe keyframe;
  keyframe.T_previous_keyframe = {Pose::exp(xi), 1e-6 * Matrix6<double>::Identity()};
  return std::vector<Keyframe>(keyframes, keyframe);
}

LoopMeasurement loop_of(std::size_t old_keyframe, std::size_t new_keyframe, double ahead_m) {
  Vector6<double> xi;
  xi << 0.0, 0.0, 0.0, 0.3, 0.0, ahead_m;
  return {old_keyframe, new_keyframe, {Pose::exp(xi), 1e-4 * Matrix6<double>::Identity()}, 50};
}

TEST_CASE("A loop is accepted when three keyframes in a row agree on it", "[stereo_slam][loops]") {
  const auto keyframes = straight_drive(40);
  LoopConsistency consistency(kSettings);
  CHECK(consistency.add(loop_of(5, 30, 0.2), keyframes).empty());
  CHECK(consistency.add(loop_of(6, 31, 0.2), keyframes).empty());
  CHECK(consistency.add(loop_of(8, 32, -0.8), keyframes).size() == 3);
  CHECK(consistency.add(loop_of(7, 33, 1.2), keyframes).size() == 1);

  SECTION("a loop that contradicts them starts a new row") {
    CHECK(consistency.add(loop_of(9, 34, 5.0), keyframes).empty());
    CHECK(consistency.add(loop_of(10, 35, 5.0), keyframes).empty());
    CHECK(consistency.add(loop_of(11, 36, 5.0), keyframes).size() == 3);
  }
  SECTION("a keyframe without a loop ends the row") {
    CHECK(consistency.add(std::nullopt, keyframes).empty());
    CHECK(consistency.add(loop_of(9, 35, 0.2), keyframes).empty());
    CHECK(consistency.add(loop_of(10, 36, 0.2), keyframes).empty());
  }
}

TEST_CASE("The allowance of the gate grows with the path length, and is zero for none",
          "[stereo_slam][loops]") {
  CHECK(gate_allowance(0.0).isZero());
  const Matrix6<double> P = gate_allowance(700.0);
  CHECK(P(0, 0) == Approx(7e-3 * 7e-3));
  CHECK(P(5, 5) == Approx(2.1 * 2.1 + 2.45 * 2.45));
}

}  // namespace
}  // namespace stereo_slam
