// SPDX-License-Identifier: MIT
// What the blocks of docs/mixtures.md need, around them, and what comes out.
#include <algorithm>
#include <numbers>
#include <random>
#include <vector>

#include "mixtures.includes.hpp"
#include "support/catch.hpp"

namespace {

using antipode::Matrix6;
using antipode::Vector6;

/// Columns [q; p], drawn from a mixture.
template <class Component>
Eigen::Matrix<double, 8, Eigen::Dynamic> draws_of(
    const std::vector<typename antipode::Mixture<Component>::Element>& elements, int count) {
  const antipode::Mixture<Component> mixture(elements);
  std::mt19937_64 rng(7);
  Eigen::Matrix<double, 8, Eigen::Dynamic> poses(8, count);
  for (int i = 0; i < count; ++i) poses.col(i) = mixture.sample(rng).coeffs();
  return poses;
}

TEST_CASE("The blocks of the page on mixtures do what it says", "[docs]") {
  const auto twist = [](double yaw_rad, double x_m) {
    Vector6<double> xi = Vector6<double>::Zero();
    xi[2] = yaw_rad;
    xi[3] = x_m;
    return xi;
  };
  constexpr double kSmall = 0.01;
  const auto pose = antipode::DualQuaternion<double>::exp(twist(0.3, 1.0));
  const Matrix6<double> Sigma = kSmall * kSmall * Matrix6<double>::Identity();
  const Matrix6<double> P = 4.0 * Sigma;
  const antipode::ProjectedGaussian<double> turned(pose.boxplus(twist(std::numbers::pi / 2.0, 0.0)), Sigma);
  const antipode::ProjectedGaussian<double> motion(antipode::DualQuaternion<double>::exp(twist(0.0, 2.0)),
                                                   Sigma);
  constexpr int kDraws = 2000;
  const auto poses =
      draws_of<antipode::ProjectedGaussian<double>>({{0.5, {pose, Sigma}}, {0.5, turned}}, kDraws);
  const Eigen::VectorXd weights = Eigen::VectorXd::Ones(kDraws);

#include "mixtures.inc"

  const auto distance = [&](const Pose& estimate) { return estimate.boxminus(pose).norm(); };
  constexpr double kRounding = 1e-9;
  CHECK(distance(seen.pose()) < kRounding);
  CHECK(distance(same.pose()) < kRounding);
  CHECK(distance(as_bingham.pose()) < kRounding);
  // Only the hypothesis that both share is left, and what the gate rejected is the weight of the other.
  CHECK(fused.mixture.size() == 1);
  CHECK(distance(fused.mixture[0].density.pose()) < kRounding);
  CHECK(fused.rejected_weight == Approx(0.3));
  CHECK(moved.size() == 2);
  CHECK((moved.heaviest().density.pose().boxminus(pose * motion.pose())).norm() < kRounding);
  CHECK(reduced.mixture.size() == 1);
  CHECK(reduced.probability_bound == 0.0);
  // Two planted components, found again to a few standard errors, 0.01 / sqrt(1000).
  CHECK(fit.mixture.size() == 2);
  CHECK(std::min(distance(fit.mixture[0].density.pose()), distance(fit.mixture[1].density.pose())) < 0.01);
}

}  // namespace
