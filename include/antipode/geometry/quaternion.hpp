// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <Eigen/Geometry>

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/jacobians.hpp>

/// @file
/// Hamilton quaternions as plain 4-vectors (w, x, y, z) with ij = k.
///
/// A unit quaternion q rotates a vector by v' = q (0, v) q*, and -q is the same rotation. Note the order of
/// the entries: Eigen::Quaternion stores (x, y, z, w), hence from_eigen and to_eigen. The algebra is
/// noexcept, and NaN propagates. The functions that throw validate their input.
namespace antipode {

/// How far from 1 the length of a caller's quaternion may be. Up to this it is normalised; beyond, the
/// factories throw.
inline constexpr double kUnitTolerance = 1e-6;
/// How far an entry of R^T R may be from the identity: admits rotation matrices read from text with six
/// digits.
inline constexpr double kOrthogonalityTolerance = 1e-5;

/// a b = (a0 b0 - av.bv, a0 bv + b0 av + av x bv).
template <detail::MatrixExpression<4> A, detail::MatrixExpression<4> B>
[[nodiscard]] Vector4<typename A::Scalar> hamilton_product(const A& left, const B& right) noexcept {
  const auto& a = left.eval();
  const auto& b = right.eval();
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

/// q* = (w, -x, -y, -z), the inverse of a unit quaternion.
template <detail::MatrixExpression<4> Q>
[[nodiscard]] Vector4<typename Q::Scalar> conjugate(const Q& q) noexcept {
  return {q[0], -q[1], -q[2], -q[3]};
}

/// L(q) with q b = L(q) b.
template <detail::MatrixExpression<4> Q>
[[nodiscard]] Matrix4<typename Q::Scalar> left_matrix(const Q& quaternion) noexcept {
  const auto& q = quaternion.eval();
  Matrix4<typename Q::Scalar> m;
  m << q[0], -q[1], -q[2], -q[3],  //
      q[1], q[0], -q[3], q[2],     //
      q[2], q[3], q[0], -q[1],     //
      q[3], -q[2], q[1], q[0];
  return m;
}

/// R(q) with a q = R(q) a.
template <detail::MatrixExpression<4> Q>
[[nodiscard]] Matrix4<typename Q::Scalar> right_matrix(const Q& quaternion) noexcept {
  const auto& q = quaternion.eval();
  Matrix4<typename Q::Scalar> m;
  m << q[0], -q[1], -q[2], -q[3],  //
      q[1], q[0], q[3], -q[2],     //
      q[2], -q[3], q[0], q[1],     //
      q[3], q[2], -q[1], q[0];
  return m;
}

/// The vector part of q (0, v) q*, for a unit quaternion q.
template <detail::MatrixExpression<4> Q, detail::MatrixExpression<3> V>
[[nodiscard]] Vector3<typename Q::Scalar> rotate(const Q& quaternion, const V& vector) noexcept {
  using Scalar = typename Q::Scalar;
  const auto& q = quaternion.eval();
  const auto& v = vector.eval();
  const Vector3<Scalar> u = q.template tail<3>();
  const Vector3<Scalar> a = u.cross(v);
  return v + Scalar(2) * (q[0] * a + u.cross(a));
}

/// The matrix of rotate(q, .), for a unit quaternion q.
template <detail::MatrixExpression<4> Q>
[[nodiscard]] Matrix3<typename Q::Scalar> rotation_matrix(const Q& quaternion) noexcept {
  using Scalar = typename Q::Scalar;
  const auto& q = quaternion.eval();
  const Scalar x2 = q[1] + q[1], y2 = q[2] + q[2], z2 = q[3] + q[3];
  const Scalar wx = x2 * q[0], wy = y2 * q[0], wz = z2 * q[0];
  const Scalar xx = x2 * q[1], xy = y2 * q[1], xz = z2 * q[1];
  const Scalar yy = y2 * q[2], yz = z2 * q[2], zz = z2 * q[3];
  Matrix3<Scalar> m;
  m << Scalar(1) - (yy + zz), xy - wz, xz + wy,  //
      xy + wz, Scalar(1) - (xx + zz), yz - wx,   //
      xz - wy, yz + wx, Scalar(1) - (xx + yy);
  return m;
}

/// The sign (+1 or -1) that makes a quaternion canonical: w > 0, or w = 0 and the first non-zero entry
/// positive.
template <detail::MatrixExpression<4> Q>
[[nodiscard]] typename Q::Scalar canonical_sign(const Q& q) noexcept {
  using Scalar = typename Q::Scalar;
  int i = 0;
  while (i < 3 && q[i] == Scalar(0)) {
    ++i;
  }
  return q[i] < Scalar(0) ? Scalar(-1) : Scalar(1);
}

/// The canonical representative of {q, -q} (see canonical_sign).
template <detail::MatrixExpression<4> Q>
[[nodiscard]] Vector4<typename Q::Scalar> canonical(const Q& q) noexcept {
  return canonical_sign(q) * q;
}

/// q / |q|. Throws unless |q| = 1 within kUnitTolerance.
template <detail::MatrixExpression<4> Q>
[[nodiscard]] Vector4<typename Q::Scalar> normalized_quaternion(const Q& quaternion) {
  using Scalar = typename Q::Scalar;
  using std::abs;
  const Vector4<Scalar> q = quaternion;
  const Scalar norm = q.norm();
  if (!(abs(norm - Scalar(1)) <= Scalar(kUnitTolerance))) [[unlikely]] {
    detail::throw_invalid("not a unit quaternion (w, x, y, z)", q);
  }
  return q / norm;
}

/// The unit quaternion of a rotation matrix, canonical. Throws unless R^T R = I within
/// kOrthogonalityTolerance and det R > 0.
///
/// Divides by the largest entry of the quaternion (Shepperd 1978), so it is accurate at every angle.
template <detail::MatrixExpression<3, 3> M>
[[nodiscard]] Vector4<typename M::Scalar> quaternion_from_rotation_matrix(const M& matrix) {
  using Scalar = typename M::Scalar;
  using std::sqrt;
  const Matrix3<Scalar> R = matrix;
  const Scalar defect = (R.transpose() * R - Matrix3<Scalar>::Identity()).cwiseAbs().maxCoeff();
  if (!(defect <= Scalar(kOrthogonalityTolerance)) || !(R.determinant() > Scalar(0))) [[unlikely]] {
    detail::throw_invalid("not a rotation matrix", R);
  }
  Vector4<Scalar> q;
  const Scalar trace = R.trace();
  if (trace > Scalar(0)) {
    const Scalar four_w = Scalar(2) * sqrt(trace + Scalar(1));
    q << four_w / Scalar(4), (R(2, 1) - R(1, 2)) / four_w, (R(0, 2) - R(2, 0)) / four_w,
        (R(1, 0) - R(0, 1)) / four_w;
  } else {
    int i = R(1, 1) > R(0, 0) ? 1 : 0;
    i = R(2, 2) > R(i, i) ? 2 : i;
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    const Scalar four_i = Scalar(2) * sqrt(R(i, i) - R(j, j) - R(k, k) + Scalar(1));
    q[0] = (R(k, j) - R(j, k)) / four_i;
    q[1 + i] = four_i / Scalar(4);
    q[1 + j] = (R(j, i) + R(i, j)) / four_i;
    q[1 + k] = (R(k, i) + R(i, k)) / four_i;
  }
  return canonical(q / q.norm());
}

/// The unit quaternion of the rotation by |phi| radians about phi. Throws unless phi and its square are
/// finite.
template <detail::MatrixExpression<3> V>
[[nodiscard]] Vector4<typename V::Scalar> quaternion_exp(const V& rotation_vector) {
  using Scalar = typename V::Scalar;
  const Vector3<Scalar> phi = rotation_vector;
  detail::require_finite("rotation vector is not finite", phi);
  const Scalar squared_angle = phi.squaredNorm();
  if (!detail::is_finite(squared_angle)) [[unlikely]] {
    detail::throw_invalid("rotation vector is too large: its square overflows", phi);
  }
  const auto half = detail::half_angle<Scalar>(squared_angle);
  return {half.cosine, half.sinc * phi[0], half.sinc * phi[1], half.sinc * phi[2]};
}

/// The rotation vector of a unit quaternion, |phi| <= pi; the same for q and -q.
template <detail::MatrixExpression<4> Q>
[[nodiscard]] Vector3<typename Q::Scalar> quaternion_log(const Q& quaternion) noexcept {
  using Scalar = typename Q::Scalar;
  const Vector4<Scalar> q = canonical(quaternion);
  const Vector3<Scalar> v = q.template tail<3>();
  return detail::recovered_angle<Scalar>(q[0], v.squaredNorm()).inverse_sinc * v;
}

/// (w, x, y, z) of an Eigen::Quaternion or of a map of one.
template <class Derived>
[[nodiscard]] Vector4<typename Derived::Scalar> from_eigen(const Eigen::QuaternionBase<Derived>& q) noexcept {
  return {q.w(), q.x(), q.y(), q.z()};
}

/// The Eigen::Quaternion of (w, x, y, z).
template <detail::MatrixExpression<4> Q>
[[nodiscard]] Eigen::Quaternion<typename Q::Scalar> to_eigen(const Q& q) noexcept {
  return {q[0], q[1], q[2], q[3]};
}

}  // namespace antipode
