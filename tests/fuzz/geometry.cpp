// SPDX-License-Identifier: MIT
// Poses, logarithms and screws near half a turn.
#include <cmath>
#include <numbers>

#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/interpolation.hpp>

#include "fuzz/fuzz_target.hpp"
#include "fuzz/hostile_input.hpp"

namespace antipode::fuzz {
namespace {

using Pose = DualQuaternion<double>;

/// A rotation whose angle is k pi + a little.
[[nodiscard]] Pose near_half_turn(HostileInput& input) {
  Vector3<double> axis = input.ordinary_numbers<3>();
  if (axis.norm() < 1e-6) axis = Vector3<double>::UnitX();
  const double angle = std::numbers::pi * input.choice(3) + input.ordinary() * input.scale();
  Vector6<double> twist;
  twist << angle * axis.normalized(), input.ordinary_numbers<3>();
  return Pose::exp(twist);
}

/// What rounding may do to poses that were moved by a twist this long.
[[nodiscard]] double tolerance(const Pose& a, const Pose& b) {
  return 1e-7 * (1.0 + a.translation().norm() + b.translation().norm());
}

void screws(Bytes bytes) {
  HostileInput input(bytes);
  allow_refusal([&] {
    const Pose a = near_half_turn(input), b = near_half_turn(input);
    if (!a.coeffs().allFinite() || a.translation().norm() > 1e6 || b.translation().norm() > 1e6) return;
    const Vector6<double> xi = a.log();
    require(xi.allFinite(), "log is not finite");
    require(xi.head<3>().norm() <= std::numbers::pi * (1.0 + 1e-12), "log is longer than half a turn");
    require(Pose::exp(xi).is_approx(a, tolerance(a, a)), "exp(log(x)) is not x");
    require(sclerp(a, b, 0.0).is_approx(a, tolerance(a, b)), "ScLERP does not start at a");
    require(sclerp(a, b, 1.0).is_approx(b, tolerance(a, b)), "ScLERP does not end at b");
    const Pose middle = sclerp(a, b, 0.5), other = sclerp(b, a, 0.5);
    const bool unique = b.boxminus(a).head<3>().norm() < std::numbers::pi - 1e-3;
    require(!unique || middle.is_approx(other, 1e3 * tolerance(a, b)), "ScLERP has two middles");
  });
}

/// Anything as coefficients, twists, matrices and times.
void poses(Bytes bytes) {
  HostileInput input(bytes);
  allow_refusal([&] {
    const Pose x = Pose::from_coefficients(input.numbers<8>());
    require(x.coeffs().allFinite(), "a pose is not finite");
    require(std::abs(x.real().norm() - 1.0) < 1e-9, "a pose is not of unit length");
    require(x.log().head<3>().allFinite(), "the logarithm of a rotation is not finite");
  });
  allow_refusal([&] {
    const Pose x = Pose::exp(input.numbers<6>());
    require(std::abs(x.real().norm() - 1.0) < 1e-9, "exp is not of unit length");
  });
  allow_refusal([&] {
    const Pose x = Pose::from_matrix(input.numbers<3, 3>(), input.numbers<3>());
    require(std::abs(x.real().norm() - 1.0) < 1e-9, "a pose from a matrix is not of unit length");
  });
  allow_refusal([&] {
    Matrix<double, 8, 4> columns;
    for (int k = 0; k < 4; ++k) columns.col(k) = near_half_turn(input).coeffs();
    const auto center = mean(columns, input.numbers<4>());
    require(!center.converged || center.pose.coeffs().allFinite(), "a mean converged to no pose");
    (void)sclerp(near_half_turn(input), near_half_turn(input), input.number());
  });
}

}  // namespace

std::vector<Target> geometry_targets() { return {{"screws", screws}, {"poses", poses}}; }

}  // namespace antipode::fuzz
