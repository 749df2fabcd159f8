// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/clock_offset.hpp"

#include <algorithm>
#include <cmath>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// A path whose speeds change all the time.
Eigen::Isometry3d pose_at(double time_s) {
  const double s = time_s + 0.4 * std::sin(0.9 * time_s) + 0.2 * std::sin(1.7 * time_s);
  return Eigen::Translation3d(3.0 * std::sin(0.31 * s), 2.0 * std::cos(0.47 * s), 0.6 * std::sin(0.83 * s)) *
         Eigen::AngleAxisd(1.1 * std::sin(0.37 * s) + 0.3 * s, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(0.8 * std::sin(0.59 * s), Eigen::Vector3d::UnitY());
}

/// Poses at a rate, with a stamp that is `late_s` later than the pose.
Trajectory recorded(double begin_s, double end_s, double rate_hz, double late_s = 0.0) {
  Trajectory trajectory;
  for (double time_s = begin_s; time_s < end_s; time_s += 1.0 / rate_hz) {
    trajectory.stamps_ns.push_back(std::llround(1e9 * (time_s + late_s)));
    trajectory.poses.push_back(pose_at(time_s));
  }
  return trajectory;
}

Trajectory without_stamps(Trajectory trajectory) {
  trajectory.stamps_ns.clear();
  return trajectory;
}

}  // namespace

TEST_CASE("Trajectories of one clock have no offset", "[clock_offset]") {
  CHECK_FALSE(find_clock_offset(recorded(0, 40, 200), recorded(3, 30, 20)));
  CHECK_FALSE(find_clock_offset(recorded(3, 30, 20), recorded(0, 40, 200)));
  CHECK_FALSE(find_clock_offset(without_stamps(recorded(0, 40, 20)), without_stamps(recorded(0, 40, 20))));
}

TEST_CASE("An offset of the clocks is found to a hundredth of a step", "[clock_offset]") {
  for (const double late_s : {0.13, -0.13, 1.0, -7.42, 12.0}) {
    CAPTURE(late_s);
    const auto offset = find_clock_offset(recorded(0, 40, 200), recorded(0, 40, 20, late_s));
    REQUIRE(offset);
    CHECK(std::abs(offset->later - late_s) < 0.01 / 20.0);
    CHECK(offset->speed_error < 0.01);
    CHECK(offset->speed_error_as_given > 0.02);
  }
}

TEST_CASE("The offset does not depend on frames of reference, scale, or a few wrong poses",
          "[clock_offset]") {
  Trajectory estimate = recorded(0, 40, 20, 0.5);
  for (auto& pose : estimate.poses) {
    pose = Eigen::Translation3d(30, -4, 7) * Eigen::AngleAxisd(2.1, Eigen::Vector3d::UnitX()) * pose *
           Eigen::AngleAxisd(1.6, Eigen::Vector3d::UnitY());
    pose.translation() *= 0.2;
  }
  for (const std::size_t lost : {100, 101, 102}) estimate.poses[lost].setIdentity();
  const auto offset = find_clock_offset(recorded(0, 40, 200), estimate);
  REQUIRE(offset);
  CHECK(std::abs(offset->later - 0.5) < 0.02 / 20.0);
}

TEST_CASE("Poses after an offset are those of the same instants", "[clock_offset]") {
  const Trajectory truth = recorded(0, 40, 200);
  const Trajectory estimate = recorded(0, 40, 20, 1.0);
  const auto offset = find_clock_offset(truth, estimate);
  REQUIRE(offset);
  const PosePairs poses = poses_after(*offset, truth, estimate);
  REQUIRE(poses.truth.size() >= estimate.poses.size() - 2);  // the ends may be outside
  for (std::size_t i = 0; i < poses.truth.size(); ++i)
    CHECK((poses.truth[i].translation() - poses.estimate[i].translation()).norm() < 0.005);
}

TEST_CASE("Without stamps an offset is a whole number of frames", "[clock_offset]") {
  const auto offset =
      find_clock_offset(without_stamps(recorded(0, 40, 20)), without_stamps(recorded(0.15, 40, 20)));
  REQUIRE(offset);
  CHECK(offset->later == -3.0);
}

TEST_CASE("Steady motion, rest and few poses show no offset", "[clock_offset]") {
  const auto steady = [](double late_s, double speed) {
    Trajectory trajectory = recorded(0, 40, 20, late_s);
    for (std::size_t i = 0; i < trajectory.poses.size(); ++i)
      trajectory.poses[i] = Eigen::Translation3d(speed * static_cast<double>(i), 0, 0);
    return trajectory;
  };
  CHECK_FALSE(find_clock_offset(steady(0.0, 0.4), steady(1.0, 0.4)));
  CHECK_FALSE(find_clock_offset(steady(0.0, 0.0), steady(1.0, 0.0)));
  CHECK_FALSE(find_clock_offset(recorded(0, 0.5, 20), recorded(0, 0.5, 20, 0.1)));
  CHECK_FALSE(find_clock_offset({}, {}));
}

TEST_CASE("Another motion that fits a little at some offset has none", "[clock_offset]") {
  Trajectory backwards = recorded(0, 40, 20);
  std::ranges::reverse(backwards.poses);
  CHECK_FALSE(find_clock_offset(recorded(0, 40, 20), backwards));
}

TEST_CASE("Stamps that are all the same, and those centuries apart, have no offset", "[clock_offset]") {
  Trajectory same = recorded(0, 40, 20);
  for (auto& stamp_ns : same.stamps_ns) stamp_ns = 5;
  CHECK_FALSE(find_clock_offset(same, recorded(0, 40, 20)));
  CHECK_FALSE(find_clock_offset(recorded(0, 40, 20), same));
  CHECK_FALSE(find_clock_offset(recorded(-3e9, -3e9 + 20, 20), recorded(0, 20, 20, 3e9)));
}

TEST_CASE("The offset of a long recording is as exact as that of a short one", "[clock_offset]") {
  const auto offset = find_clock_offset(recorded(0, 1000, 20), recorded(0, 1000, 20, 0.3));
  REQUIRE(offset);
  CHECK(std::abs(offset->later - 0.3) < 0.01 / 20.0);
}
