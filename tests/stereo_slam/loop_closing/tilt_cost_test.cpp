// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/tilt_cost.hpp"

#include <cstddef>
#include <random>

#include "support/catch.hpp"
#include "support/ceres.hpp"
// After it, for its CHECK.
#include <antipode/ceres/pose_manifold.hpp>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/tilt_measurement.hpp"
#include "stereo_slam/loop_closing/pose_graph.hpp"
#include "stereo_slam/support/ring_drive.hpp"

namespace stereo_slam {
namespace {

using test::ate_m;
using test::kGraphSettings;
using test::kRingNodes;
using test::kRingSeed;
using test::ring_drive;
using test::RingDrive;

TiltMeasurement tilt_of(const Pose& T_first_keyframe, double sigma_rad, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0.0, sigma_rad);
  Vector6<double> xi = Vector6<double>::Zero();
  for (int i = 0; i < 3; ++i) xi[i] = normal(random);
  TiltMeasurement tilt{.vertical_first = Vector3<double>(0.1, 0.9, 0.2).normalized()};
  tilt.vertical = (T_first_keyframe * Pose::exp(xi)).rotation_matrix().transpose() * tilt.vertical_first;
  tilt.whitening.row(0) = tilt.vertical.unitOrthogonal().transpose() / sigma_rad;
  tilt.whitening.row(1) = tilt.vertical.cross(tilt.vertical.unitOrthogonal()).transpose() / sigma_rad;
  return tilt;
}

TEST_CASE("The cost of a tilt has the derivatives that finite differences have", "[stereo_slam][tilt_cost]") {
  std::mt19937_64 random(kRingSeed);
  const RingDrive d = ring_drive();
  const Pose first = d.truth[10], keyframe = d.truth[30];
  const TiltCost cost(tilt_of(first.inverse() * keyframe, 0.01, random));
  const auto at = [&](const Vector6<double>& a, const Vector6<double>& b) {
    const auto x = first.boxplus(a).coeffs(), y = keyframe.boxplus(b).coeffs();
    const double* blocks[] = {x.data(), y.data()};
    Vector2<double> r;
    REQUIRE(cost.Evaluate(blocks, r.data(), nullptr));
    return r;
  };
  using ByNumbers = Eigen::Matrix<double, 2, 8, Eigen::RowMajor>;
  ByNumbers J[2];
  double* jacobians[] = {J[0].data(), J[1].data()};
  const auto x = first.coeffs(), y = keyframe.coeffs();
  const double* blocks[] = {x.data(), y.data()};
  Vector2<double> r;
  REQUIRE(cost.Evaluate(blocks, r.data(), jacobians));
  Eigen::Matrix<double, 8, 6, Eigen::RowMajor> plus[2];
  antipode::PoseManifold().PlusJacobian(x.data(), plus[0].data());
  antipode::PoseManifold().PlusJacobian(y.data(), plus[1].data());
  constexpr double kStep = 1e-6;  // rounding: 1e-16 * 100 / 1e-6
  for (int i = 0; i < 6; ++i) {
    const Vector6<double> e = kStep * Vector6<double>::Unit(i), zero = Vector6<double>::Zero();
    CHECK(((at(e, zero) - at(-e, zero)) / (2.0 * kStep) - J[0] * plus[0].col(i)).norm() < 1e-6);
    CHECK(((at(zero, e) - at(zero, -e)) / (2.0 * kStep) - J[1] * plus[1].col(i)).norm() < 1e-6);
  }
}

TEST_CASE("Without loops the last node of a graph with tilts is that of a filter",
          "[stereo_slam][tilt_cost]") {
  RingDrive d = ring_drive();
  d.graph.common_error_rad = 0.001;
  LinkedPose filtered;
  for (std::size_t k = 1; k < kRingNodes; ++k) {
    PoseGraphEdge& edge = d.graph.odometry[k - 1];
    if (k % 3 == 0) edge.tilt = tilt_of(d.truth[k], 0.002, d.random);
    filtered = add_link(filtered, edge.T_from_to, edge.measured, edge.tilt);
  }
  const double open_m = ate_m(d.graph.poses, d.truth);
  d.graph.poses = optimize(d.graph, kGraphSettings).poses;
  const LinkedPose last = marginals(d.graph, kGraphSettings).back();
  // The filter is linearised at poses whose heading is up to .03 rad wrong: .03 of the first order, the
  // square of it in the poses.
  CHECK(last.estimate.covariance.isApprox(filtered.estimate.covariance, 0.05));
  CHECK(last.J_common.isApprox(filtered.J_common, 0.05));
  CHECK((last.estimate.pose.inverse() * filtered.estimate.pose).log().head<3>().norm() < 1e-3);
  CHECK(ate_m(d.graph.poses, d.truth) < open_m);
}

}  // namespace
}  // namespace stereo_slam
