// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>

#include <antipode/eigen_types.hpp>
#include <antipode/geometry/detail/series.hpp>
#include <antipode/geometry/jacobians.hpp>

/// @file
/// Integrals of a rotation at a constant rate, which carry a force in the axes of a turning body to its
/// velocity and its position.
namespace antipode {

namespace detail {

/// Coefficients of the second integral, I/2 + b P + c P^2 with P = [phi]x and t = |phi|: b is that of
/// JacobianCoefficients, c_slope = (dc/dt) / t.
template <class Scalar>
struct SecondIntegralCoefficients {
  Scalar c;        ///< (t^2 / 2 + cos t - 1) / t^4
  Scalar c_slope;  ///< (4 - 4 cos t - t sin t - t^2) / t^6
};

/// The SecondIntegralCoefficients of t^2. The closed forms lose 12 / t^2 and 360 / t^4 units of the last
/// place, so that the series go further than elsewhere. Their truncation errors are below 1e-17 of the value.
template <class Scalar>
[[nodiscard]] SecondIntegralCoefficients<Scalar> second_integral_coefficients(const Scalar& x) noexcept {
  using std::cos;
  using std::sin;
  using std::sqrt;
  if (x < Scalar(1)) {
    return {polynomial(x, 1. / 24, -1. / 720, 1. / 40320, -1. / 3628800, 1. / 479001600, -1. / 87178291200.,
                       1. / 20922789888000., -1. / 6402373705728000.),
            polynomial(x, -1. / 360, 1. / 10080, -1. / 604800, 1. / 59875200, -1. / 8717829120.,
                       1. / 1743565824000., -1. / 457312407552000., 1. / 152056375511040000.)};
  }
  const Scalar t = sqrt(x), sine = sin(t), versine = Scalar(1) - cos(t);
  return {(Scalar(0.5) * x - versine) / (x * x), (Scalar(4) * versine - t * sine - x) / (x * x * x)};
}

/// d (m I + a P + b P^2) v / d phi with P = [phi]x for the coefficients a and b of |phi| and their slopes.
template <class Scalar>
[[nodiscard]] Matrix3<Scalar> slope_of_rotated(const Scalar& a, const Scalar& b, const Scalar& a_slope,
                                               const Scalar& b_slope, const Vector3<Scalar>& phi,
                                               const Vector3<Scalar>& v) noexcept {
  const Vector3<Scalar> once = skew(phi) * v, twice = skew(phi) * once;
  const Vector3<Scalar> along = a_slope * once + b_slope * twice;
  const Scalar dot = phi.dot(v);
  Matrix3<Scalar> J;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      J(i, j) = along[i] * phi[j] + b * (phi[i] * v[j] - Scalar(2) * v[i] * phi[j]);
    }
    J(j, j) += b * dot;
  }
  return J - a * skew(v);
}

}  // namespace detail

/// Integrals over one turn by phi [rad] at a constant rate, with Exp(s phi) after the share s of the time:
///
///     first   int_0^1 Exp(s phi) ds          = I + a P + b P^2, so3_left_jacobian(phi)
///     second  int_0^1 (1 - s) Exp(s phi) ds  = I/2 + b P + c P^2
///
/// with P = [phi]x, t = |phi|, a = (1 - cos t)/t^2, b = (t - sin t)/t^3, c = (t^2/2 + cos t - 1)/t^4. A body
/// that turns at the rate w for the time T under the specific force f, both constant in its own axes, gains
/// T first f in velocity and T^2 second f in position (phi = w T). Without singularities for any phi.
template <std::floating_point Scalar>
struct RotationIntegrals {
  Matrix3<Scalar> first;   ///< of the rotation
  Matrix3<Scalar> second;  ///< of the first integral
};

/// The RotationIntegrals of phi.
template <std::floating_point Scalar>
[[nodiscard]] RotationIntegrals<Scalar> rotation_integrals(const Vector3<Scalar>& phi) noexcept {
  const Scalar squared = phi.squaredNorm();
  const auto c = detail::jacobian_coefficients<Scalar>(squared);
  const Matrix3<Scalar> I = Matrix3<Scalar>::Identity(), P = skew(phi), P2 = detail::skew_squared(phi);
  const Scalar second = detail::second_integral_coefficients<Scalar>(squared).c;
  return {detail::weighted_sum<Scalar, 3>({Scalar(1), c.a, c.b}, {I, P, P2}),
          detail::weighted_sum<Scalar, 3>({Scalar(0.5), c.b, second}, {I, P, P2})};
}

/// The derivatives of first v and of second v by phi, for a constant vector v.
template <std::floating_point Scalar>
[[nodiscard]] RotationIntegrals<Scalar> rotation_integrals_along(const Vector3<Scalar>& phi,
                                                                 const Vector3<Scalar>& v) noexcept {
  const Scalar squared = phi.squaredNorm();
  const auto c = detail::jacobian_coefficients<Scalar>(squared);
  const auto d = detail::second_integral_coefficients<Scalar>(squared);
  return {detail::slope_of_rotated<Scalar>(c.a, c.b, c.a_slope, c.b_slope, phi, v),
          detail::slope_of_rotated<Scalar>(c.b, d.c, c.b_slope, d.c_slope, phi, v)};
}

}  // namespace antipode
