// SPDX-License-Identifier: MIT
#include "simulator/rendering/rig_disturbance.hpp"

#include <cmath>

#include <Eigen/Geometry>

#include "support/catch.hpp"

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr PinholeCamera kKitti{1241, 376, 718.856, 718.856, 607.1928, 185.2157};
constexpr std::size_t kFrames = 4000;

/// Displacements (u, v, roll) of all frames, one a column.
Eigen::Matrix3Xd displacements(const RigDisturbance& disturbance, std::size_t frames = kFrames,
                               std::uint64_t seed = 1) {
  const auto errors = right_camera_errors(disturbance, kKitti, frames, seed);
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(frames));
  for (std::size_t i = 0; i < frames; ++i)
    result.col(static_cast<Eigen::Index>(i)) = displacement_px(kKitti, errors[i].rotation_rad);
  return result;
}

double correlation(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.cwiseProduct(b).sum() / (a.norm() * b.norm());
}

/// Where the rotated camera sees the distant point that the ideal one sees at `px`.
Vector2d seen(const Vector3d& rotation_rad, const Vector2d& px) {
  const Vector3d ray((px.x() - kKitti.cx) / kKitti.fx, (px.y() - kKitti.cy) / kKitti.fy, 1.0);
  const Vector2d turned = (rotation_matrix(rotation_rad) * ray).hnormalized();
  return {kKitti.fx * turned.x() + kKitti.cx, kKitti.fy * turned.y() + kKitti.cy};
}

TEST_CASE("A distant point is displaced by what the rotation is said to displace", "[rendering]") {
  for (const auto& error : right_camera_errors({.vibration_px = 1.0}, kKitti, 20, 3)) {
    const Vector3d moved = displacement_px(kKitti, error.rotation_rad);
    const Vector2d centre(kKitti.cx, kKitti.cy);
    CHECK((seen(error.rotation_rad, centre) - centre - moved.head<2>()).norm() < 0.01);  // second order
    for (const double side : {-1.0, 1.0}) {
      const Vector3d roll(0.0, 0.0, error.rotation_rad.z());
      const Vector2d border = centre + Vector2d(side * 0.5 * kKitti.width_px, 0.0);
      CHECK((seen(roll, border) - border - Vector2d(0.0, side * moved.z())).norm() < 0.01);
    }
  }
}

TEST_CASE("A vibration has the given standard deviations and is white", "[rendering]") {
  const Eigen::Matrix3Xd moved = displacements({.vibration_px = 2.0});
  const double rate = 1.0 / std::sqrt(2.0 * kFrames);  // standard error of a standard deviation
  const Vector3d sigma = (moved.rowwise().squaredNorm() / kFrames).cwiseSqrt();
  CHECK(sigma.x() == Approx(2.0).epsilon(4.0 * rate));
  CHECK(sigma.y() == Approx(0.6).epsilon(4.0 * rate));
  CHECK(sigma.z() == Approx(0.6).epsilon(4.0 * rate));
  const double error = 1.0 / std::sqrt(kFrames);
  CHECK(std::abs(correlation(moved.row(0), moved.row(1))) < 4.0 * error);
  CHECK(std::abs(correlation(moved.leftCols(kFrames - 1), moved.rightCols(kFrames - 1))) < 4.0 * error);
}

TEST_CASE("A vibration with a correlation time keeps its size and decays by e over it", "[rendering]") {
  const Eigen::Matrix3Xd moved = displacements({.vibration_px = 1.0, .vibration_frames = 10.0});
  const auto lag = static_cast<Eigen::Index>(kFrames) - 10;
  const double error = std::sqrt(20.0 / kFrames);  // of 2 x 10 frames a sample
  CHECK(moved.row(0).norm() / std::sqrt(kFrames) == Approx(1.0).margin(4.0 * error));
  CHECK(correlation(moved.row(0).head(lag), moved.row(0).tail(lag)) ==
        Approx(std::exp(-1.0)).margin(4.0 * error));
}

TEST_CASE("A drift is linear, from none in the first frame, and adds to a vibration", "[rendering]") {
  const Eigen::Matrix3Xd moved = displacements({.drift_px = -2.0}, 5);
  for (Eigen::Index i = 0; i < 5; ++i) {
    const double share = 0.25 * static_cast<double>(i);
    CHECK((moved.col(i) - share * Vector3d(-2.0, -0.6, -0.6)).norm() < 1e-12);
  }
  CHECK(displacements({.drift_px = 1.0}, 1).norm() == 0.0);
  const Eigen::Matrix3Xd vibration = displacements({.vibration_px = 1.0}, 5);
  CHECK((displacements({.vibration_px = 1.0, .drift_px = -2.0}, 5) - vibration - moved).norm() < 1e-12);
}

TEST_CASE("Vibrations repeat with their seed, and a longer recording begins like a shorter one",
          "[rendering]") {
  const RigDisturbance vibration{.vibration_px = 1.0, .vibration_frames = 3.0};
  CHECK(displacements(vibration, 50) == displacements(vibration, 80).leftCols(50));
  CHECK(displacements(vibration, 50, 1) != displacements(vibration, 50, 2));
}

}  // namespace
}  // namespace stereo_slam::simulator
