// SPDX-License-Identifier: MIT
#include "simulator/world/ride.hpp"

#include <cmath>

#include "support/catch.hpp"

namespace stereo_slam::simulator {
namespace {

constexpr double kFps = 10.0;
const CameraPath kStraight = [] {
  CameraPath path;
  for (int i = 0; i < 2000; ++i) path.emplace_back(Eigen::Translation3d(0.0, 0.0, 1.0 * i));
  return path;
}();

/// Bounce, pitch and roll of every frame, one a column.
Eigen::Matrix3Xd motions(const Ride& ride, std::uint64_t seed = 1, double fps = kFps) {
  const CameraPath path = on_bad_road(kStraight, ride, fps, seed);
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(path.size()));
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Eigen::Isometry3d added = kStraight[i].inverse() * path[i];
    const Eigen::Vector3d angles = added.linear().eulerAngles(0, 1, 2);
    const auto near_zero = [](double angle) { return std::remainder(angle, std::acos(-1.0)); };
    result.col(static_cast<Eigen::Index>(i)) << added.translation().y(), near_zero(angles[0]),
        near_zero(angles[2]);
  }
  return result;
}

TEST_CASE("A ride has the given bounce, and the pitch and roll derived from it", "[ride]") {
  const Ride ride{.bounce_m = 0.02};
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Eigen::Matrix3Xd motion = motions(ride, seed);
    const Eigen::Vector3d sigma = (motion.rowwise().squaredNorm() / motion.cols()).cwiseSqrt();
    // over 200 s, waves that differ by less than 5 mHz do not average out
    CHECK(sigma.x() == Approx(0.02).epsilon(0.05));
    CHECK(sigma.y() == Approx(0.04 / 2.7).epsilon(0.05));
    CHECK(sigma.z() == Approx(0.02 / 2.7).epsilon(0.05));
  }
}

TEST_CASE("A bounce of 17 mm turns a camera of KITTI's by ten pixels a frame", "[ride]") {
  constexpr double kFocal_px = 718.856;
  const Eigen::RowVectorXd pitch = kFocal_px * motions({.bounce_m = 0.017}).row(1);
  const Eigen::Index steps = pitch.cols() - 1;
  const double step_px = (pitch.tail(steps) - pitch.head(steps)).norm() / std::sqrt(steps);
  CHECK(step_px == Approx(10.0).epsilon(0.1));
}

TEST_CASE("A ride is smooth: at a thousand frames a second it hardly changes from frame to frame", "[ride]") {
  const Eigen::Matrix3Xd motion = motions({.bounce_m = 0.02}, 1, 1000.0);
  const Eigen::Index steps = motion.cols() - 1;
  const Eigen::Matrix3Xd change = motion.rightCols(steps) - motion.leftCols(steps);
  CHECK((change.rowwise().norm().array() < 0.03 * motion.rowwise().norm().array()).all());
}

TEST_CASE("Rides repeat with their seed, and without a bounce the path is unchanged", "[ride]") {
  const Ride ride{.bounce_m = 0.02};
  CHECK(motions(ride, 1) == motions(ride, 1));
  CHECK(motions(ride, 1) != motions(ride, 2));
  const CameraPath still = on_bad_road(kStraight, {}, kFps, 1);
  for (std::size_t i = 0; i < still.size(); ++i) REQUIRE(still[i].matrix() == kStraight[i].matrix());
}

}  // namespace
}  // namespace stereo_slam::simulator
