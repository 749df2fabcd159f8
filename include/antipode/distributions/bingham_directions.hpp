// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <type_traits>

#include <antipode/detail/check.hpp>
#include <antipode/distributions/bingham.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/quaternion.hpp>

/// @file
/// Orientations from a direction that is measured in the axes of the body: gravity, or a magnetic field.
namespace antipode {

/// The density of the orientations R_reference_body under which a direction, known in the axes of the
/// reference, is seen in those of the body with the error of a von Mises-Fisher density: exp(concentration
/// body . R^T reference). Neither vector need be of unit length.
///
/// This is a quadratic form in the quaternion, so the Bingham density is exact, for any error: its
/// concentrations are (-2 c, -2 c, 0, 0), the rotation about the direction is free. product() with the
/// density of another direction fixes it, as in Wahba's problem. A small error of sigma radians in each axis
/// is a concentration of 1 / sigma^2. Throws unless both vectors are finite and not zero and the
/// concentration is not negative.
template <std::floating_point Scalar>
[[nodiscard]] Bingham<Scalar, 4> bingham_from_direction(
    const Vector3<Scalar>& body, const std::type_identity_t<Vector3<Scalar>>& reference,
    std::type_identity_t<Scalar> concentration) {
  using Quaternion = Vector4<Scalar>;
  const auto pure = [](const Vector3<Scalar>& v) { return Quaternion(Scalar(0), v[0], v[1], v[2]); };
  const auto unit = [](const Vector3<Scalar>& v) {
    const Scalar largest = v.cwiseAbs().maxCoeff();
    if (!(largest > Scalar(0)) || !detail::all_finite(v)) [[unlikely]] {
      detail::throw_invalid("a direction is zero or not finite", v);
    }
    return Vector3<Scalar>((v / largest).normalized());
  };
  if (!(concentration >= Scalar(0))) [[unlikely]] {
    detail::throw_invalid("concentration of a direction is negative or not a number", concentration);
  }
  const Vector3<Scalar> b = unit(body), r = unit(reference);
  // (R b) . r = q^T A q for a symmetric A with eigenvalues 1, 1, -1, -1. I + A is twice the projection on the
  // plane of the quaternions that turn b to r; its longest column is one of them.
  const Matrix4<Scalar> twice =
      Matrix4<Scalar>::Identity() + left_matrix(pure(r)).transpose().lazyProduct(right_matrix(pure(b)));
  Eigen::Index longest = 0;
  twice.diagonal().maxCoeff(&longest);
  const Quaternion mode = twice.col(longest).normalized();
  Eigen::Index smallest = 0;
  b.cwiseAbs().minCoeff(&smallest);
  const Vector3<Scalar> u = b.cross(Vector3<Scalar>::Unit(smallest)).normalized(), v = b.cross(u);
  Matrix4<Scalar> axes;
  axes << hamilton_product(mode, pure(u)), hamilton_product(mode, pure(v)), hamilton_product(mode, pure(b)),
      mode;
  const Scalar z = Scalar(-2) * concentration;
  return Bingham<Scalar, 4>::from_parameters(axes, Vector4<Scalar>(z, z, Scalar(0), Scalar(0)));
}

/// The orientations R_reference_body of a body at rest that feels the specific force [m/s^2], in its own
/// axes, with an error of sigma [m/s^2] in each axis. `gravity` [m/s^2] is in the axes of the reference, (0,
/// 0, -9.81) say. The tilt has a standard deviation of about sigma / |gravity| [rad], the heading is free.
///
/// Bayes' rule with uniform orientations: exp(-|f + R^T g|^2 / (2 sigma^2)) is proportional to the density
/// of a direction with the concentration |f| |g| / sigma^2. Throws unless both vectors are finite and not
/// zero and sigma is positive.
template <std::floating_point Scalar>
[[nodiscard]] Bingham<Scalar, 4> bingham_from_gravity(const Vector3<Scalar>& specific_force,
                                                      const std::type_identity_t<Vector3<Scalar>>& gravity,
                                                      std::type_identity_t<Scalar> sigma) {
  if (!(sigma > Scalar(0))) [[unlikely]] {
    detail::throw_invalid("standard deviation of a specific force is not positive", sigma);
  }
  const Scalar concentration = (specific_force.norm() / sigma) * (gravity.norm() / sigma);
  return bingham_from_direction<Scalar>(specific_force, -gravity, concentration);
}

}  // namespace antipode
