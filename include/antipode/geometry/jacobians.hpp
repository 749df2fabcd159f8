// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/detail/series.hpp>

/// Differentials of the exponential maps of SO(3) and SE(3), with phi a rotation vector and xi = (phi, rho) a
/// twist.
///
/// The left Jacobian J_l and the right one J_r(x) = J_l(-x) obey, to first order in d,
///   exp(x + d) = exp(J_l(x) d) exp(x) = exp(x) exp(J_r(x) d).
/// Formulas: T. Barfoot, "State Estimation for Robotics", sec. 7.1.5. The inverses exist for |phi| < 2 pi.
namespace antipode {

namespace detail {

/// Lower-left block of the left Jacobian of SE(3) (Barfoot's Q), for P = [phi]x and W = [rho]x.
template <class Scalar>
[[nodiscard]] Matrix3<Scalar> se3_jacobian_coupling(const Matrix3<Scalar>& P, const Matrix3<Scalar>& W,
                                                    const JacobianCoefficients<Scalar>& k) noexcept {
  const Matrix3<Scalar> PW = P * W;
  const Matrix3<Scalar> WP = W * P;
  const Matrix3<Scalar> PWP = PW * P;
  return Scalar(0.5) * W + k.b * (PW + WP + PWP) + k.c * (P * PW + WP * P - Scalar(3) * PWP) +
         k.d * (PWP * P + P * PWP);
}

}  // namespace detail

/// [v]x, the matrix with [v]x u = v x u.
template <detail::MatrixExpression<3> V>
[[nodiscard]] Matrix3<typename V::Scalar> skew(const V& vector) noexcept {
  using Scalar = typename V::Scalar;
  const auto& v = vector.eval();
  Matrix3<Scalar> m;
  m << Scalar(0), -v[2], v[1],  //
      v[2], Scalar(0), -v[0],   //
      -v[1], v[0], Scalar(0);
  return m;
}

/// Left Jacobian of SO(3): I + (1 - cos t)/t^2 [phi]x + (t - sin t)/t^3 [phi]x^2, with t = |phi|.
template <detail::MatrixExpression<3> V>
[[nodiscard]] Matrix3<typename V::Scalar> so3_left_jacobian(const V& phi) noexcept {
  using Scalar = typename V::Scalar;
  const Matrix3<Scalar> P = skew(phi);
  const auto k = detail::jacobian_coefficients<Scalar>(phi.squaredNorm());
  return Matrix3<Scalar>::Identity() + k.a * P + k.b * (P * P);
}

/// Inverse of so3_left_jacobian.
template <detail::MatrixExpression<3> V>
[[nodiscard]] Matrix3<typename V::Scalar> so3_left_jacobian_inverse(const V& phi) noexcept {
  using Scalar = typename V::Scalar;
  const Matrix3<Scalar> P = skew(phi);
  const Scalar k = detail::inverse_jacobian_coefficient<Scalar>(phi.squaredNorm());
  return Matrix3<Scalar>::Identity() - Scalar(0.5) * P + k * (P * P);
}

/// Right Jacobian of SO(3), so3_left_jacobian(-phi).
template <detail::MatrixExpression<3> V>
[[nodiscard]] Matrix3<typename V::Scalar> so3_right_jacobian(const V& phi) noexcept {
  return so3_left_jacobian(-phi);
}

/// Inverse of so3_right_jacobian.
template <detail::MatrixExpression<3> V>
[[nodiscard]] Matrix3<typename V::Scalar> so3_right_jacobian_inverse(const V& phi) noexcept {
  return so3_left_jacobian_inverse(-phi);
}

/// Left Jacobian of SE(3), [[J, 0], [Q, J]] with J the left Jacobian of SO(3).
template <detail::MatrixExpression<6> V>
[[nodiscard]] Matrix6<typename V::Scalar> se3_left_jacobian(const V& xi) noexcept {
  using Scalar = typename V::Scalar;
  const Vector6<Scalar> x = xi;
  const Matrix3<Scalar> P = skew(x.template head<3>());
  const auto k = detail::jacobian_coefficients<Scalar>(x.template head<3>().squaredNorm());
  const Matrix3<Scalar> J = Matrix3<Scalar>::Identity() + k.a * P + k.b * (P * P);
  Matrix6<Scalar> jacobian;
  jacobian.template topLeftCorner<3, 3>() = J;
  jacobian.template topRightCorner<3, 3>().setZero();
  jacobian.template bottomLeftCorner<3, 3>() =
      detail::se3_jacobian_coupling<Scalar>(P, skew(x.template tail<3>()), k);
  jacobian.template bottomRightCorner<3, 3>() = J;
  return jacobian;
}

/// Inverse of se3_left_jacobian, [[K, 0], [-K Q K, K]] with K the inverse left Jacobian of SO(3).
template <detail::MatrixExpression<6> V>
[[nodiscard]] Matrix6<typename V::Scalar> se3_left_jacobian_inverse(const V& xi) noexcept {
  using Scalar = typename V::Scalar;
  const Vector6<Scalar> x = xi;
  const Matrix3<Scalar> P = skew(x.template head<3>());
  const auto k = detail::jacobian_coefficients<Scalar>(x.template head<3>().squaredNorm());
  const Matrix3<Scalar> K = so3_left_jacobian_inverse(x.template head<3>());
  const Matrix3<Scalar> Q = detail::se3_jacobian_coupling<Scalar>(P, skew(x.template tail<3>()), k);
  Matrix6<Scalar> jacobian;
  jacobian.template topLeftCorner<3, 3>() = K;
  jacobian.template topRightCorner<3, 3>().setZero();
  jacobian.template bottomLeftCorner<3, 3>() = -(K * Q * K);
  jacobian.template bottomRightCorner<3, 3>() = K;
  return jacobian;
}

/// Right Jacobian of SE(3), se3_left_jacobian(-xi).
template <detail::MatrixExpression<6> V>
[[nodiscard]] Matrix6<typename V::Scalar> se3_right_jacobian(const V& xi) noexcept {
  return se3_left_jacobian(-xi);
}

/// Inverse of se3_right_jacobian.
template <detail::MatrixExpression<6> V>
[[nodiscard]] Matrix6<typename V::Scalar> se3_right_jacobian_inverse(const V& xi) noexcept {
  return se3_left_jacobian_inverse(-xi);
}

}  // namespace antipode
