// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/pose_jumps.hpp"

#include <cmath>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// A drive with steps from .5 to 1.5 m, which begins far from zero; both files have the same poses.
PosePairs drive(std::size_t count) {
  PosePairs poses;
  for (std::size_t i = 0; i < count; ++i) {
    const double s = static_cast<double>(i);
    poses.truth.emplace_back(Eigen::Translation3d(20.0 + s + 2.5 * std::sin(0.2 * s), 0, 0));
  }
  poses.estimate = poses.truth;
  return poses;
}

}  // namespace

TEST_CASE("A drive, a scale and a pause of both are no jumps", "[pose_jumps]") {
  PosePairs poses = drive(200);
  poses.truth.erase(poses.truth.begin() + 50, poses.truth.begin() + 90);
  poses.estimate.erase(poses.estimate.begin() + 50, poses.estimate.begin() + 90);
  for (const double scale : {1.0, 0.01, 100.0}) {
    CAPTURE(scale);
    for (auto& pose : poses.estimate) pose.translation() *= scale;
    const PoseJumps jumps = find_jumps(poses);
    CHECK(jumps.truth.empty());
    CHECK(jumps.estimate.empty());
  }
}

TEST_CASE("Poses that were written as zeros are a jump there and one back", "[pose_jumps]") {
  PosePairs poses = drive(200);
  for (const std::size_t lost : {30, 31, 32}) poses.truth[lost].setIdentity();
  const PoseJumps jumps = find_jumps(poses);
  REQUIRE(jumps.truth.size() == 2);
  CHECK(jumps.estimate.empty());
  CHECK(jumps.truth[0].pair == 30);
  CHECK(jumps.truth[1].pair == 33);
  CHECK(jumps.truth[0].length_m == poses.truth[29].translation().norm());
}

TEST_CASE("A pose that was repeated for ten frames is a jump at its end", "[pose_jumps]") {
  PosePairs poses = drive(200);
  for (std::size_t i = 50; i < 60; ++i) poses.estimate[i] = poses.estimate[49];
  const PoseJumps jumps = find_jumps(poses);
  REQUIRE(jumps.estimate.size() == 1);
  CHECK(jumps.estimate[0].pair == 60);
  CHECK(jumps.truth.empty());
}

TEST_CASE("The noise of a body at rest is no jump", "[pose_jumps]") {
  PosePairs poses;
  for (int i = 0; i < 100; ++i) {
    poses.truth.emplace_back(Eigen::Translation3d(1e-5 * (i % 2), 0, 0));
    poses.estimate.emplace_back(Eigen::Translation3d(i % 20 == 0 ? 0.01 : 0.0, 0, 0));
  }
  CHECK(find_jumps(poses).estimate.empty());
  CHECK(find_jumps({}).truth.empty());
}
