// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <ostream>

#include <Eigen/Geometry>

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/detail/dual_quaternion_product.hpp>
#include <antipode/geometry/jacobians.hpp>
#include <antipode/geometry/quaternion.hpp>

/// @file
/// Poses as unit dual quaternions, and their operations with Jacobians.
namespace antipode {

/// A pose (rigid motion) of SE(3) as a unit dual quaternion q + eps p with p = 1/2 (0, t) q.
///
/// Memory: eight scalars [q; p]; q = (w, x, y, z) is the rotation, t [m] the translation in the parent frame,
/// so that T_a_b * p_b = R(q) p_b + t = p_a. `Coefficients` is the storage: Vector8<Scalar> owns the numbers;
/// an Eigen::Map views numbers in memory of someone else (a Ceres parameter block, say), and assigning to it
/// writes there.
///
/// Constraints (the Study quadric): |q| = 1 and q.p = 0. Factories check or establish them and throw
/// std::invalid_argument with the invalid value. Products keep them up to rounding errors, which
/// renormalized() removes; once in a hundred products is enough. NaN propagates.
///
/// Antipodes: x and -x (all eight numbers) are the same pose. log, is_approx and everything built on them do
/// not depend on the sign.
///
/// Tangent vectors xi = (phi, rho) [rad, m], rotation first, perturb on the right:
/// x.boxplus(xi) = x * exp(xi).
///
/// Reference: DQV-SLAM sec. III; K. Daniilidis, "Hand-Eye Calibration Using Dual Quaternions", IJRR 1999.
template <class Coefficients>
class BasicDualQuaternion {
  static constexpr bool kOwns = std::same_as<Coefficients, typename Coefficients::PlainObject>;

 public:
  using Scalar = typename Coefficients::Scalar;                   ///< of the eight numbers
  using Owned = BasicDualQuaternion<Vector8<Scalar>>;             ///< a pose that owns its numbers
  using Isometry = Eigen::Transform<Scalar, 3, Eigen::Isometry>;  ///< Eigen's rigid motion

  /// The identity.
  BasicDualQuaternion() noexcept requires kOwns
      : coeffs_(Scalar(1), Scalar(0), Scalar(0), Scalar(0), Scalar(0), Scalar(0), Scalar(0), Scalar(0)) {}

  /// A copy of a pose with another storage.
  template <class Other>
  requires kOwns BasicDualQuaternion(const BasicDualQuaternion<Other>& other)
  noexcept : coeffs_(other.coeffs()) {}

  /// A view of eight scalars [q; p]. Nothing is checked: the caller keeps them alive and sees to it that they
  /// are a unit dual quaternion.
  template <std::convertible_to<const Scalar*> Pointer>
  requires(!kOwns) explicit BasicDualQuaternion(Pointer data) noexcept : coeffs_(data) {}

  /// Copies the eight numbers. A view writes them to the memory that it shows.
  template <class Other>
  BasicDualQuaternion& operator=(const BasicDualQuaternion<Other>& other) noexcept {
    coeffs_ = other.coeffs();
    return *this;
  }

  /// The identity.
  [[nodiscard]] static Owned identity() noexcept { return Owned(); }

  /// The pose v -> R(q) v + t. Throws unless |q| = 1 within kUnitTolerance (it is then normalised) and t is
  /// finite.
  template <detail::MatrixExpression<4> Q, detail::MatrixExpression<3> T>
  [[nodiscard]] static Owned from_rotation_translation(const Q& rotation, const T& translation) {
    const Vector4<Scalar> q = normalized_quaternion(rotation);
    const Vector3<Scalar> t = translation;
    detail::require_finite("translation is not finite", t);
    return unchecked(q, Scalar(0.5) * hamilton_product(Vector4<Scalar>(Scalar(0), t[0], t[1], t[2]), q));
  }

  /// The pose v -> R v + t. Throws unless R is a rotation matrix within kOrthogonalityTolerance and t is
  /// finite.
  template <detail::MatrixExpression<3, 3> M, detail::MatrixExpression<3> T>
  [[nodiscard]] static Owned from_matrix(const M& rotation, const T& translation) {
    return from_rotation_translation(quaternion_from_rotation_matrix(rotation), translation);
  }

  /// The pose of an Eigen::Isometry3d, say. Throws unless its linear part is a rotation matrix within
  /// kOrthogonalityTolerance.
  template <int Options>
  [[nodiscard]] static Owned from_isometry(
      const Eigen::Transform<Scalar, 3, Eigen::Isometry, Options>& isometry) {
    return from_matrix(isometry.linear(), isometry.translation());
  }

  /// The pose [q; p], renormalised. Throws if | |q| - 1 | or |q.p| / (1 + |p|) exceeds kUnitTolerance.
  template <detail::MatrixExpression<8> C>
  [[nodiscard]] static Owned from_coefficients(const C& coefficients) {
    using std::abs;
    const Owned x = unchecked(coefficients);
    const Scalar defect = abs(x.real().norm() - Scalar(1));
    const Scalar dual_defect = abs(x.real().dot(x.dual())) / (Scalar(1) + x.dual().norm());
    if (!(defect <= Scalar(kUnitTolerance)) || !(dual_defect <= Scalar(kUnitTolerance))) [[unlikely]] {
      detail::throw_invalid("not a unit dual quaternion [q; p]", x.coeffs());
    }
    return x.renormalized();
  }

  /// The pose [q; p] that the caller knows to be on the Study quadric.
  template <detail::MatrixExpression<8> C>
  [[nodiscard]] static Owned unchecked(const C& coefficients) noexcept {
    return Owned(Vector8<Scalar>(coefficients));
  }
  /// The same from the two halves q and p.
  [[nodiscard]] static Owned unchecked(const Vector4<Scalar>& q, const Vector4<Scalar>& p) noexcept {
    return Owned(q, p);
  }

  /// The screw motion of a twist (phi, rho) [rad, m], with t = so3_left_jacobian(phi) rho. Throws unless the
  /// twist is finite and |phi|^2 and phi.rho do not overflow.
  template <detail::MatrixExpression<6> V>
  [[nodiscard]] static Owned exp(const V& twist) {
    const auto& xi = twist.eval();
    const Vector3<Scalar> phi(xi[0], xi[1], xi[2]);
    const Vector3<Scalar> rho(xi[3], xi[4], xi[5]);
    const Scalar angle_squared = phi.squaredNorm();
    const Scalar phi_rho = phi.dot(rho);
    if (!detail::is_finite(angle_squared) || !detail::is_finite(phi_rho)) [[unlikely]] {
      const bool finite = detail::is_finite(xi.sum());
      detail::throw_invalid(
          finite ? "twist (phi, rho) is too large: its square overflows" : "twist (phi, rho) is not finite",
          xi);
    }
    const auto half = detail::half_angle(angle_squared);
    const Scalar s = half.sinc;
    const Scalar k = half.slope * phi_rho;
    return unchecked({half.cosine, s * phi[0], s * phi[1], s * phi[2]},
                     {Scalar(-0.5) * s * phi_rho, s * rho[0] + k * phi[0], s * rho[1] + k * phi[1],
                      s * rho[2] + k * phi[2]});
  }

  /// The eight numbers [q; p].
  [[nodiscard]] const Coefficients& coeffs() const noexcept { return coeffs_; }
  /// q, the rotation (w, x, y, z).
  [[nodiscard]] Vector4<Scalar> real() const noexcept {
    return {coeffs_[0], coeffs_[1], coeffs_[2], coeffs_[3]};
  }
  /// p = 1/2 (0, t) q.
  [[nodiscard]] Vector4<Scalar> dual() const noexcept {
    return {coeffs_[4], coeffs_[5], coeffs_[6], coeffs_[7]};
  }

  /// The rotation as a unit quaternion (w, x, y, z).
  [[nodiscard]] Vector4<Scalar> rotation() const noexcept { return real(); }
  /// The rotation as a matrix R.
  [[nodiscard]] Matrix3<Scalar> rotation_matrix() const noexcept { return antipode::rotation_matrix(real()); }
  /// t = 2 vec(p q*), in the parent frame.
  [[nodiscard]] Vector3<Scalar> translation() const noexcept {
    const Scalar w = coeffs_[0], x = coeffs_[1], y = coeffs_[2], z = coeffs_[3];
    const Scalar p_w = coeffs_[4], p_x = coeffs_[5], p_y = coeffs_[6], p_z = coeffs_[7];
    return {Scalar(2) * ((w * p_x - p_w * x) + (y * p_z - z * p_y)),
            Scalar(2) * ((w * p_y - p_w * y) + (z * p_x - x * p_z)),
            Scalar(2) * ((w * p_z - p_w * z) + (x * p_y - y * p_x))};
  }
  /// The pose as Eigen's matrix, v -> R v + t.
  [[nodiscard]] Isometry isometry() const noexcept {
    Isometry T = Isometry::Identity();
    T.linear() = rotation_matrix();
    T.translation() = translation();
    return T;
  }

  /// R v + t of a point v: the dual part of x (1 + eps v) x^o with the total conjugate, multiplied out.
  template <detail::MatrixExpression<3> P>
  [[nodiscard]] Vector3<Scalar> operator*(const P& point) const noexcept {
    const auto& v = point.eval();
    const Scalar w = coeffs_[0], x = coeffs_[1], y = coeffs_[2], z = coeffs_[3];
    const Scalar a_x = y * v[2] - z * v[1] + coeffs_[5];
    const Scalar a_y = z * v[0] - x * v[2] + coeffs_[6];
    const Scalar a_z = x * v[1] - y * v[0] + coeffs_[7];
    return {v[0] + Scalar(2) * (w * a_x + y * a_z - z * a_y - coeffs_[4] * x),
            v[1] + Scalar(2) * (w * a_y + z * a_x - x * a_z - coeffs_[4] * y),
            v[2] + Scalar(2) * (w * a_z + x * a_y - y * a_x - coeffs_[4] * z)};
  }

  /// The composition x y: first y, then x. T_a_c = T_a_b * T_b_c.
  template <class Other>
  [[nodiscard]] Owned operator*(const BasicDualQuaternion<Other>& y) const noexcept {
    return Owned(detail::dual_quaternion_product(coeffs_, y.coeffs_));
  }

  /// The inverse pose (the quaternion conjugate, as x is unit).
  [[nodiscard]] Owned inverse() const noexcept { return quaternion_conjugate(); }
  /// (q*, p*), the inverse of a unit dual quaternion.
  [[nodiscard]] Owned quaternion_conjugate() const noexcept {
    return unchecked(conjugate(real()), conjugate(dual()));
  }
  /// (q, -p).
  [[nodiscard]] Owned dual_conjugate() const noexcept { return unchecked(real(), -dual()); }
  /// (q*, -p*), the conjugate that transforms points: x (1 + eps v) x^o = 1 + eps (R v + t).
  [[nodiscard]] Owned total_conjugate() const noexcept {
    return unchecked(conjugate(real()), -conjugate(dual()));
  }

  /// The projection to the Study quadric, x / ||x|| with the dual norm. Throws if q is zero or a number is
  /// not finite.
  [[nodiscard]] Owned renormalized() const {
    using std::sqrt;
    const Scalar squared_norm = real().squaredNorm();
    if (!(squared_norm >= std::numeric_limits<Scalar>::min()) || !detail::all_finite(coeffs_)) [[unlikely]] {
      detail::throw_invalid("dual quaternion [q; p] cannot be normalised", coeffs_);
    }
    const Scalar norm = sqrt(squared_norm);
    Vector4<Scalar> q = real(), p = dual();
    for (int i = 0; i < 4; ++i) {
      q[i] /= norm;
      p[i] /= norm;
    }
    const Scalar q_p = q.dot(p);
    for (int i = 0; i < 4; ++i) p[i] -= q_p * q[i];
    return unchecked(q, p);
  }

  /// The representative of {x, -x} whose rotation is canonical (w > 0; see antipode::canonical).
  [[nodiscard]] Owned canonical() const noexcept { return unchecked(canonical_sign(real()) * coeffs_); }

  /// The twist (phi, rho) [rad, m] of the screw from the identity to this pose, |phi| <= pi: the inverse of
  /// exp.
  [[nodiscard]] Vector6<Scalar> log() const noexcept {
    const Scalar sign = canonical_sign(real());
    const Vector3<Scalar> v = real_vector();
    const auto angle = detail::recovered_angle<Scalar>(sign * coeffs_[0], v.squaredNorm());
    const Scalar scale = sign * angle.inverse_sinc;
    const Scalar phi_rho = Scalar(-2) * scale * coeffs_[4];
    const Scalar slope = detail::sinc_slope<Scalar>(sign * coeffs_[0], angle.sinc, angle.squared);
    const Scalar k = angle.inverse_sinc * slope * phi_rho;
    Vector6<Scalar> xi;
    for (int i = 0; i < 3; ++i) {
      xi[i] = scale * v[i];
      xi[3 + i] = scale * coeffs_[5 + i] - k * xi[i];
    }
    return xi;
  }

  /// Ad(x) = [[R, 0], [[t]x R, R]], with x exp(xi) x^-1 = exp(Ad(x) xi).
  [[nodiscard]] Matrix6<Scalar> adjoint() const noexcept {
    const Matrix3<Scalar> R = rotation_matrix();
    return detail::dual_matrix<Scalar>(R, skew(translation()) * R);
  }

  /// This pose perturbed on the right, x exp(xi).
  template <detail::MatrixExpression<6> V>
  [[nodiscard]] Owned boxplus(const V& xi) const {
    return *this * Owned::exp(xi);
  }
  /// The twist from `other` to this pose, log(other^-1 x): x = other.boxplus(x.boxminus(other)).
  template <class Other>
  [[nodiscard]] Vector6<Scalar> boxminus(const BasicDualQuaternion<Other>& other) const noexcept {
    return (other.inverse() * *this).log();
  }

  /// Whether both are the same pose: |x - s y| <= tolerance (1 + |p|), with the sign s = +-1 that aligns the
  /// rotations.
  template <class Other>
  [[nodiscard]] bool is_approx(const BasicDualQuaternion<Other>& other, Scalar tolerance) const noexcept {
    const Scalar sign = real().dot(other.real()) < Scalar(0) ? Scalar(-1) : Scalar(1);
    return (coeffs_ - sign * other.coeffs()).norm() <= tolerance * (Scalar(1) + dual().norm());
  }

  /// The same pose in another scalar type.
  template <class NewScalar>
  [[nodiscard]] BasicDualQuaternion<Vector8<NewScalar>> cast() const {
    return BasicDualQuaternion<Vector8<NewScalar>>::unchecked(coeffs_.template cast<NewScalar>());
  }

 private:
  template <class>
  friend class BasicDualQuaternion;

  // Entry by entry: a packet read of freshly written scalars would stall the processor.
  [[nodiscard]] Vector3<Scalar> real_vector() const noexcept { return {coeffs_[1], coeffs_[2], coeffs_[3]}; }

  explicit BasicDualQuaternion(const Coefficients& coefficients) noexcept : coeffs_(coefficients) {}
  BasicDualQuaternion(const Vector4<Scalar>& q, const Vector4<Scalar>& p) noexcept
      : coeffs_(q[0], q[1], q[2], q[3], p[0], p[1], p[2], p[3]) {}

  Coefficients coeffs_;
};

/// A pose that owns its eight scalars.
template <class Scalar>
using DualQuaternion = BasicDualQuaternion<Vector8<Scalar>>;
/// A pose in memory owned by someone else.
template <class Scalar>
using DualQuaternionView = BasicDualQuaternion<Eigen::Map<Vector8<Scalar>>>;
/// A read-only pose in memory owned by someone else.
template <class Scalar>
using ConstDualQuaternionView = BasicDualQuaternion<Eigen::Map<const Vector8<Scalar>>>;

/// Prints rotation and translation: {q: [w x y z], t: [x y z]}, with all digits that tell them from other
/// numbers.
template <class C>
std::ostream& operator<<(std::ostream& out, const BasicDualQuaternion<C>& x) {
  detail::print_row(out << "{q: ", x.real());
  detail::print_row(out << ", t: ", x.translation());
  return out << '}';
}

// The same operations as functions with optional Jacobians. Both sides are perturbed on the right:
// f(x exp(d)) = f(x) exp(J d) for pose-valued f, f(x) + J d for vector-valued f, to first order in d.

/// a b. J_a = Ad(b^-1), J_b = I.
template <class A, class B>
[[nodiscard]] auto compose(const BasicDualQuaternion<A>& a, const BasicDualQuaternion<B>& b,
                           Matrix6<typename A::Scalar>* J_a = nullptr,
                           Matrix6<typename A::Scalar>* J_b = nullptr) noexcept {
  if (J_a) {
    *J_a = b.inverse().adjoint();
  }
  if (J_b) {
    J_b->setIdentity();
  }
  return a * b;
}

/// a^-1. J = -Ad(a).
template <class A>
[[nodiscard]] auto inverse(const BasicDualQuaternion<A>& a,
                           Matrix6<typename A::Scalar>* J = nullptr) noexcept {
  if (J) {
    *J = -a.adjoint();
  }
  return a.inverse();
}

/// a * point. J_a = R [-[point]x, I] (3 x 6), J_point = R.
template <class A, detail::MatrixExpression<3> P>
[[nodiscard]] Vector3<typename A::Scalar> act(const BasicDualQuaternion<A>& a, const P& point,
                                              Matrix<typename A::Scalar, 3, 6>* J_a = nullptr,
                                              Matrix3<typename A::Scalar>* J_point = nullptr) noexcept {
  const Matrix3<typename A::Scalar> R = a.rotation_matrix();
  if (J_a) {
    *J_a << -R * skew(point), R;
  }
  if (J_point) {
    *J_point = R;
  }
  return a * point;
}

/// R p + t of every column p of `points`, 3 x N with N fixed or not: a cloud from the child's frame to the
/// parent's.
template <class A, detail::ColumnsExpression<3> P>
[[nodiscard]] Matrix<typename A::Scalar, 3, P::ColsAtCompileTime> act(const BasicDualQuaternion<A>& a,
                                                                      const P& points) {
  using Scalar = typename A::Scalar;
  const Matrix3<Scalar> R = a.rotation_matrix();
  const Vector3<Scalar> t = a.translation();
  const auto& p = points.derived().eval();
  Matrix<Scalar, 3, P::ColsAtCompileTime> moved(3, p.cols());
  for (Eigen::Index k = 0; k < p.cols(); ++k) {
    const Scalar x = p(0, k), y = p(1, k), z = p(2, k);
    for (int i = 0; i < 3; ++i) moved(i, k) = R(i, 0) * x + R(i, 1) * y + R(i, 2) * z + t[i];
  }
  return moved;
}

/// exp(xi). J = J_r(xi).
template <detail::MatrixExpression<6> V>
[[nodiscard]] auto exp(const V& xi, Matrix6<typename V::Scalar>* J = nullptr) {
  if (J) {
    *J = se3_right_jacobian(xi);
  }
  return DualQuaternion<typename V::Scalar>::exp(xi);
}

/// log(a). J = J_r(log(a))^-1.
template <class A>
[[nodiscard]] Vector6<typename A::Scalar> log(const BasicDualQuaternion<A>& a,
                                              Matrix6<typename A::Scalar>* J = nullptr) noexcept {
  const Vector6<typename A::Scalar> xi = a.log();
  if (J) {
    *J = se3_right_jacobian_inverse(xi);
  }
  return xi;
}

}  // namespace antipode
