// SPDX-License-Identifier: MIT
#include <cstdint>

#include "stereo_slam/support/dynamic_scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

double length_m(const Trajectory& trajectory) {
  double length = 0.0;
  for (std::size_t i = 1; i < trajectory.poses.size(); ++i) {
    length += (trajectory.poses[i].translation() - trajectory.poses[i - 1].translation()).norm();
  }
  return length;
}

TEST_CASE("With 40 % of the features on moving vehicles the SLAM tracks the street",
          "[stereo_slam][slam][dynamic]") {
  constexpr int kFrames = 60;
  constexpr int kVehicles = 40;
  const test::DynamicDrive jam(kFrames, kVehicles, 0.5);
  const auto outcome = test::run_among_vehicles(jam, Settings{});

  CAPTURE(outcome.features.value(), outcome.most_features);
  REQUIRE(outcome.features.value() > 0.2);
  REQUIRE(outcome.most_features > 0.4);
  CHECK(outcome.results.front().status == TrackingStatus::kInitializing);
  for (std::size_t i = 1; i < outcome.results.size(); ++i) {
    CAPTURE(i);
    CHECK(outcome.results[i].status == TrackingStatus::kOk);
  }
  CAPTURE(outcome.ate_m, length_m(jam.truth()));
  CHECK(outcome.ate_m < 0.005 * length_m(jam.truth()));

  // What keeps it there: the consensus of the odometry, the flow gate, and the ellipses.
  CHECK(outcome.odometry.value() < 0.05);
  CHECK(outcome.refused.moving > outcome.followed.moving / 2);
  CHECK(outcome.refused.standing() < outcome.followed.standing() / 5);  // covered by vehicles, mostly
  CHECK(outcome.matches.value() < 0.1);
}

TEST_CASE("A jam in which the odometry finds no motion for a while costs no frame",
          "[stereo_slam][slam][dynamic]") {
  constexpr std::uint64_t kSeed = 48;  // lorries that turn with the camera hide nearly all of the street
  const test::DynamicDrive jam(60, 40, 0.5, kSeed);
  const auto outcome = test::run_among_vehicles(jam, Settings{});
  for (std::size_t i = 1; i < outcome.results.size(); ++i) {
    CAPTURE(i);
    CHECK(outcome.results[i].status == TrackingStatus::kOk);
  }
  CAPTURE(outcome.ate_m, length_m(jam.truth()));
  CHECK(outcome.ate_m < 0.001 * length_m(jam.truth()));
}

}  // namespace
}  // namespace stereo_slam
