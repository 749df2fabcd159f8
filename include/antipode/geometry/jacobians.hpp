// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/detail/series.hpp>

/// @file
/// Differentials of the exponential maps of SO(3) and SE(3), at phi and xi = (phi, rho).
///
/// The left Jacobian J_l and the right one, J_r(x) = J_l(-x), obey to first order in d
///
///     exp(x + d) = exp(J_l(x) d) exp(x) = exp(x) exp(J_r(x) d).
///
/// The Jacobian of SE(3) is that of SO(3) at the dual vector phi + eps rho: its lower-left block is the
/// derivative of the diagonal ones along rho. Written out, this is Q of T. Barfoot, "State Estimation for
/// Robotics", sec. 7.1.5. The inverses exist for |phi| < 2 pi.
namespace antipode {

/// [v]x, the matrix with [v]x u = v x u.
template <detail::MatrixExpression<3> V>
[[nodiscard]] Matrix3<typename V::Scalar> skew(const V& vector) noexcept {
  using Scalar = typename V::Scalar;
  const auto& v = vector.eval();
  Matrix3<Scalar> m;
  m(0, 0) = m(1, 1) = m(2, 2) = Scalar(0);
  m(0, 1) = -v[2];
  m(0, 2) = v[1];
  m(1, 0) = v[2];
  m(1, 2) = -v[0];
  m(2, 0) = -v[1];
  m(2, 1) = v[0];
  return m;
}

namespace detail {

/// [phi]x^2 = phi phi^T - |phi|^2 I.
template <class Scalar>
[[nodiscard]] Matrix3<Scalar> skew_squared(const Vector3<Scalar>& phi) noexcept {
  const Scalar squared_norm = phi.squaredNorm();
  Matrix3<Scalar> m;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) m(i, j) = phi[i] * phi[j];
    m(j, j) -= squared_norm;
  }
  return m;
}

/// [phi]x [rho]x + [rho]x [phi]x, the derivative of skew_squared along rho.
template <class Scalar>
[[nodiscard]] Matrix3<Scalar> skew_squared_along(const Vector3<Scalar>& phi,
                                                 const Vector3<Scalar>& rho) noexcept {
  const Scalar twice_dot = Scalar(2) * phi.dot(rho);
  Matrix3<Scalar> m;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) m(i, j) = phi[i] * rho[j] + phi[j] * rho[i];
    m(j, j) -= twice_dot;
  }
  return m;
}

/// sum_k weights_k A_k, from left to right. Loops compile faster than nested Eigen expressions.
template <class Scalar, std::size_t Count>
[[nodiscard]] Matrix3<Scalar> weighted_sum(const Scalar (&weights)[Count],
                                           const Matrix3<Scalar> (&A)[Count]) noexcept {
  Matrix3<Scalar> sum;
  for (int i = 0; i < 9; ++i) {
    Scalar entry = weights[0] * A[0].data()[i];
    for (std::size_t k = 1; k < Count; ++k) entry += weights[k] * A[k].data()[i];
    sum.data()[i] = entry;
  }
  return sum;
}

/// The action of the dual matrix A + eps B on dual vectors: [[A, 0], [B, A]].
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> dual_matrix(const Matrix3<Scalar>& A, const Matrix3<Scalar>& B) noexcept {
  Matrix6<Scalar> m;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      m(i, j) = m(3 + i, 3 + j) = A(i, j);
      m(3 + i, j) = B(i, j);
      m(i, 3 + j) = Scalar(0);
    }
  }
  return m;
}

}  // namespace detail

/// Left Jacobian of SO(3): I + (1 - cos t)/t^2 [phi]x + (t - sin t)/t^3 [phi]x^2 with t = |phi|.
template <detail::MatrixExpression<3> V>
[[nodiscard]] Matrix3<typename V::Scalar> so3_left_jacobian(const V& rotation_vector) noexcept {
  using Scalar = typename V::Scalar;
  const Vector3<Scalar> phi = rotation_vector;
  const auto c = detail::jacobian_coefficients<Scalar>(phi.squaredNorm());
  return detail::weighted_sum<Scalar, 3>({Scalar(1), c.a, c.b},
                                         {Matrix3<Scalar>::Identity(), skew(phi), detail::skew_squared(phi)});
}

/// Inverse of so3_left_jacobian.
template <detail::MatrixExpression<3> V>
[[nodiscard]] Matrix3<typename V::Scalar> so3_left_jacobian_inverse(const V& rotation_vector) noexcept {
  using Scalar = typename V::Scalar;
  const Vector3<Scalar> phi = rotation_vector;
  const auto c = detail::inverse_jacobian_coefficients<Scalar>(phi.squaredNorm());
  return detail::weighted_sum<Scalar, 3>({Scalar(1), Scalar(-0.5), c.k},
                                         {Matrix3<Scalar>::Identity(), skew(phi), detail::skew_squared(phi)});
}

/// Right Jacobian of SO(3), so3_left_jacobian(-phi).
template <detail::MatrixExpression<3> V>
[[nodiscard]] Matrix3<typename V::Scalar> so3_right_jacobian(const V& phi) noexcept {
  return so3_left_jacobian((-phi).eval());
}

/// Inverse of so3_right_jacobian.
template <detail::MatrixExpression<3> V>
[[nodiscard]] Matrix3<typename V::Scalar> so3_right_jacobian_inverse(const V& phi) noexcept {
  return so3_left_jacobian_inverse((-phi).eval());
}

/// Left Jacobian of SE(3), 6 x 6.
template <detail::MatrixExpression<6> V>
[[nodiscard]] Matrix6<typename V::Scalar> se3_left_jacobian(const V& xi) noexcept {
  using Scalar = typename V::Scalar;
  const auto& v = xi.eval();
  const Vector3<Scalar> phi(v[0], v[1], v[2]), rho(v[3], v[4], v[5]);
  const auto c = detail::jacobian_coefficients<Scalar>(phi.squaredNorm());
  const Scalar phi_rho = phi.dot(rho);
  const Matrix3<Scalar> P = skew(phi);
  const Matrix3<Scalar> P2 = detail::skew_squared(phi);
  const Matrix3<Scalar> along = detail::skew_squared_along(phi, rho);
  return detail::dual_matrix<Scalar>(
      detail::weighted_sum<Scalar, 3>({Scalar(1), c.a, c.b}, {Matrix3<Scalar>::Identity(), P, P2}),
      detail::weighted_sum<Scalar, 4>({c.a, c.b, c.a_slope * phi_rho, c.b_slope * phi_rho},
                                      {skew(rho), along, P, P2}));
}

/// Inverse of se3_left_jacobian.
template <detail::MatrixExpression<6> V>
[[nodiscard]] Matrix6<typename V::Scalar> se3_left_jacobian_inverse(const V& xi) noexcept {
  using Scalar = typename V::Scalar;
  const auto& v = xi.eval();
  const Vector3<Scalar> phi(v[0], v[1], v[2]), rho(v[3], v[4], v[5]);
  const auto c = detail::inverse_jacobian_coefficients<Scalar>(phi.squaredNorm());
  const Matrix3<Scalar> P2 = detail::skew_squared(phi);
  const Matrix3<Scalar> along = detail::skew_squared_along(phi, rho);
  return detail::dual_matrix<Scalar>(
      detail::weighted_sum<Scalar, 3>({Scalar(1), Scalar(-0.5), c.k},
                                      {Matrix3<Scalar>::Identity(), skew(phi), P2}),
      detail::weighted_sum<Scalar, 3>({Scalar(-0.5), c.k, c.k_slope * phi.dot(rho)}, {skew(rho), along, P2}));
}

/// Right Jacobian of SE(3), se3_left_jacobian(-xi).
template <detail::MatrixExpression<6> V>
[[nodiscard]] Matrix6<typename V::Scalar> se3_right_jacobian(const V& xi) noexcept {
  return se3_left_jacobian((-xi).eval());
}

/// Inverse of se3_right_jacobian.
template <detail::MatrixExpression<6> V>
[[nodiscard]] Matrix6<typename V::Scalar> se3_right_jacobian_inverse(const V& xi) noexcept {
  return se3_left_jacobian_inverse((-xi).eval());
}

}  // namespace antipode
