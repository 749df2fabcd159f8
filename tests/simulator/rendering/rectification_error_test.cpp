// SPDX-License-Identifier: MIT
#include "simulator/rendering/rectification_error.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "support/catch.hpp"

namespace stereo_slam::simulator {
namespace {

constexpr PinholeCamera kCamera{1241, 376, 718.856, 718.856, 607.1928, 185.2157};
constexpr double kBaseline_m = 0.54;

/// Where the rig's right camera sees a point far ahead, less where the ideal one does.
Eigen::Vector2d displacement(const StereoRig& rig, const Eigen::Vector2d& px) {
  const Eigen::Vector3d ray((px.x() - kCamera.cx) / kCamera.fx, (px.y() - kCamera.cy) / kCamera.fy, 1.0);
  const Eigen::Vector2d seen = (rig.T_right_left.linear() * ray).hnormalized();
  const Eigen::Vector2d distorted = (1.0 + rig.right.coefficients.at(0) * seen.squaredNorm()) * seen;
  return Eigen::Vector2d(rig.right.fx * distorted.x() + rig.right.cx,
                         rig.right.fy * distorted.y() + rig.right.cy) -
         px;
}

double largest_displacement_px(const StereoRig& rig) {
  double largest = 0.0;
  for (int u = 0; u < kCamera.width_px; u += 20) {
    for (int v = 0; v < kCamera.height_px; v += 15) {
      largest = std::max(largest, displacement(rig, {u, v}).norm());
    }
  }
  return largest;
}

TEST_CASE("A misrectified rig displaces the right image by the given amount", "[rendering]") {
  for (const double error_px : {0.1, 1.0, 5.0}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const StereoRig rig = misrectified_rig(kCamera, kBaseline_m, {error_px, seed});
      CHECK(largest_displacement_px(rig) == Approx(error_px).epsilon(0.05));
    }
  }
}

TEST_CASE("The left camera and the baseline of a misrectified rig are exact", "[rendering]") {
  const StereoRig rig = misrectified_rig(kCamera, kBaseline_m, {1.0, 7});
  CHECK(rig.left.cx == kCamera.cx);
  CHECK(rig.left.coefficients.at(0) == 0.0);
  const Eigen::Vector3d right_in_left = rig.T_right_left.inverse().translation();
  CHECK((right_in_left - Eigen::Vector3d(kBaseline_m, 0.0, 0.0)).norm() < 1e-12);
}

TEST_CASE("Seeds mix the causes of a rectification error differently", "[rendering]") {
  const StereoRig a = misrectified_rig(kCamera, kBaseline_m, {1.0, 1});
  const StereoRig b = misrectified_rig(kCamera, kBaseline_m, {1.0, 2});
  CHECK(std::abs(a.right.cx - b.right.cx) > 1e-3);
  CHECK(a.right.coefficients.at(0) != b.right.coefficients.at(0));
}

TEST_CASE("Without a rectification error both cameras are ideal", "[rendering]") {
  const StereoRig rig = misrectified_rig(kCamera, kBaseline_m, {0.0, 1});
  CHECK(largest_displacement_px(rig) < 1e-9);
}

}  // namespace
}  // namespace stereo_slam::simulator
