// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/keyframe_trajectory.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// A steady drive.
std::vector<PoseGaussian> drive(std::size_t frames, const Pose& step) {
  std::vector<PoseGaussian> poses(1);
  while (poses.size() < frames) {
    const double variance = 0.01 * static_cast<double>(poses.size());
    poses.push_back({poses.back().pose * step, variance * Matrix6<double>::Identity()});
  }
  return poses;
}

TEST_CASE("Frames of a steady drive keep their poses, tracked or not", "[stereo_slam][bridging]") {
  const auto before = drive(12, test::car_motion());
  auto poses = before;
  bridge_untracked(poses, {true, true, true, false, false, false, true, true, false, true, true, false});
  for (std::size_t i = 0; i < poses.size(); ++i) {
    CAPTURE(i);
    CHECK(poses[i].pose.is_approx(before[i].pose, 1e-9));
  }
  CHECK(poses[11].covariance == before[11].covariance);
}

TEST_CASE("Untracked frames share the prediction error in proportion to their standard deviations",
          "[stereo_slam][bridging]") {
  const auto along = [](double z) {
    return Pose::exp((Vector6<double>() << 0.0, 0.0, 0.0, 0.0, 0.0, z).finished());
  };
  auto poses = drive(6, along(1.0));
  const double sigma[] = {0.0, 0.1, 0.2, 0.6};  // the last one grows by .4, so that at the end it is 1.0
  for (std::size_t i = 0; i < 4; ++i) poses[i].covariance = sigma[i] * sigma[i] * Matrix6<double>::Identity();
  poses[4].pose = along(8.0);  // instead of 4
  poses[4].covariance.setZero();
  poses[5].pose = along(9.0);
  const auto before = poses;
  bridge_untracked(poses, {true, false, false, false, true, true});
  for (std::size_t i = 0; i < 4; ++i)
    CHECK(poses[i].pose.is_approx(along(static_cast<double>(i) + 4.0 * sigma[i]), 1e-9));
  CHECK(poses[2].covariance(0, 0) == Approx(0.8 * before[2].covariance(0, 0)));

  // Where the standard deviation does not grow, they share it in equal parts.
  auto certain = drive(4, along(1.0));
  for (auto& pose : certain) pose.covariance.setZero();
  certain[3].pose = along(6.0);  // instead of 3
  bridge_untracked(certain, {true, false, false, true});
  CHECK(certain[1].pose.is_approx(along(2.0), 1e-9));
  CHECK(certain[2].pose.is_approx(along(4.0), 1e-9));
}

TEST_CASE("Without a tracked frame after them, untracked frames keep their predicted poses",
          "[stereo_slam][bridging]") {
  std::vector<PoseGaussian> none;
  bridge_untracked(none, {});
  CHECK(none.empty());
  auto blind = drive(4, test::car_motion());
  const auto before = blind;
  bridge_untracked(blind, {true, false, false, false});
  for (std::size_t i = 0; i < blind.size(); ++i) CHECK(blind[i].pose.coeffs() == before[i].pose.coeffs());
}

}  // namespace
}  // namespace stereo_slam
