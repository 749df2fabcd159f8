// SPDX-License-Identifier: MIT
#include "simulator/world/path_spline.hpp"

#include <cmath>

#include "support/catch.hpp"

namespace stereo_slam::simulator {
namespace {

/// A screw about y with pitch, by more than a turn: quaternions change their sign on the way.
CameraPath screw(int frames, double fps) {
  CameraPath path;
  for (int i = 0; i < frames; ++i) {
    const double t = i / fps;
    path.push_back(Eigen::Translation3d(5 * std::cos(t), 0.5 * t, 5 * std::sin(t)) *
                   Eigen::Isometry3d(Eigen::AngleAxisd(-t, Eigen::Vector3d::UnitY())));
  }
  return path;
}

TEST_CASE("A spline meets every pose", "[path_spline]") {
  const CameraPath path = screw(100, 10.0);
  const PathSpline spline(path, 10.0);
  CHECK(spline.duration_s() == Approx(9.9));
  for (std::size_t i = 0; i < path.size(); ++i) {
    const BodyMotion motion = spline.at(static_cast<double>(i) / 10.0);
    CHECK((motion.T_world_body.matrix() - path[i].matrix()).norm() <= 1e-13);
  }
}

TEST_CASE("Derivatives of a spline are those of its motion", "[path_spline]") {
  const PathSpline spline(screw(100, 10.0), 10.0);
  constexpr double h = 1e-5;
  for (const double t : {0.03, 1.0, 2.57, 7.4, 9.85}) {
    CAPTURE(t);
    const BodyMotion before = spline.at(t - h), now = spline.at(t), after = spline.at(t + h);
    const Eigen::Vector3d velocity =
        (after.T_world_body.translation() - before.T_world_body.translation()) / (2 * h);
    CHECK((now.velocity - velocity).norm() <= 1e-8);
    CHECK((now.acceleration - (after.velocity - before.velocity) / (2 * h)).norm() <=
          1e-4);  // kinks at frames
    const Eigen::AngleAxisd turn(before.T_world_body.linear().transpose() * after.T_world_body.linear());
    CHECK((now.angular_velocity - turn.angle() * turn.axis() / (2 * h)).norm() <= 1e-7);
  }
}

TEST_CASE("A spline of a smooth motion has its derivatives", "[path_spline]") {
  const PathSpline spline(screw(200, 20.0), 20.0);
  const double t = 4.321;  // away from the ends, where a natural spline has no acceleration
  const BodyMotion motion = spline.at(t);
  const Eigen::Vector3d inwards(-std::cos(t), 0, -std::sin(t));
  CHECK((motion.acceleration - 5 * inwards).norm() <= 5 * std::pow(1 / 20.0, 2));
  CHECK((motion.angular_velocity - Eigen::Vector3d(0, -1, 0)).norm() <= 1e-4);
  CHECK((motion.velocity - Eigen::Vector3d(-5 * std::sin(t), 0.5, 5 * std::cos(t))).norm() <= 1e-4);
}

TEST_CASE("Two poses are a motion at a constant speed, and one is none", "[path_spline]") {
  const PathSpline spline(screw(2, 10.0), 10.0);
  CHECK(spline.at(0.05).acceleration.norm() == 0.0);
  CHECK(spline.at(0.0).velocity.isApprox(spline.at(0.1).velocity, 1e-12));
  CHECK_THROWS_AS(PathSpline(screw(1, 10.0), 10.0), std::invalid_argument);
}

}  // namespace
}  // namespace stereo_slam::simulator
