// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>

#include <antipode/detail/cholesky.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/jacobians.hpp>
#include <antipode/geometry/quaternion.hpp>

namespace antipode::detail {

/// The squared Mahalanobis distance of two centred estimates of one pose in exponential coordinates, with the
/// covariance of each at its own mode: chi-square with six degrees of freedom, or less, if both are right.
/// Infinite if they differ in a direction in which both are certain.
///
/// On a common tangent space, where they are multiplied, coordinates grow with the tangent of the angle: half
/// a turn apart, differences by 1.3 and standard deviations by 2 compared with these. Here the difference is
/// half the rotation vector from one mode to the other, and the covariances of u are carried to the middle of
/// the way by parallel transport on S^3, which turns them and changes no length.
template <class Scalar, Projection kProjection>
[[nodiscard]] Scalar disagreement_squared(const BasicProjectedGaussian<Scalar, kProjection>& a,
                                          const BasicProjectedGaussian<Scalar, kProjection>& b) {
  using std::atan2;
  if (!a.is_centered() || !b.is_centered()) return disagreement_squared(a.centered(), b.centered());
  const Vector4<Scalar> r = hamilton_product(conjugate(a.tangent_point()), b.tangent_point());
  const Vector3<Scalar> v = (r[0] < Scalar(0) ? Scalar(-1) : Scalar(1)) * r.template tail<3>();
  const Scalar sine = v.norm(), angle = atan2(sine, std::abs(r[0]));
  const Vector3<Scalar> axis = sine > Scalar(0) ? Vector3<Scalar>(v / sine) : Vector3<Scalar>::Zero();
  const Matrix3<Scalar> turn =
      rotation_matrix(central_projection<Scalar>({1, 0, 0, 0}, std::tan(angle / Scalar(4)) * axis));
  Vector6<Scalar> difference = b.mean() - a.mean();
  difference.template head<3>() = angle * axis;
  const auto L = cholesky_factor<Scalar, 6>(
      Matrix6<Scalar>(transform_rotation<Scalar>(turn.transpose(), a.covariance()) +
                      transform_rotation<Scalar>(turn, b.covariance())));
  if (!L) return std::numeric_limits<Scalar>::infinity();
  return solve_lower<Scalar, 6, 1>(*L, difference).squaredNorm();
}

}  // namespace antipode::detail
