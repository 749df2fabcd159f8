// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <numbers>
#include <type_traits>

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/jacobians.hpp>

/// @file
/// Poses with a velocity, SE_2(3), and with more vectors that turn with the rotation, SE_k(3).
namespace antipode {

/// The parts of an ExtendedPose by their names; K is the number of its vectors, the position included.
template <std::floating_point Scalar, int K>
struct ExtendedPoseParts {
  DualQuaternion<Scalar> pose = DualQuaternion<Scalar>::identity();     ///< R and p
  Vector3<Scalar> velocity = Vector3<Scalar>::Zero();                   ///< v, in the axes of the world
  Matrix<Scalar, 3, K - 2> vectors = Matrix<Scalar, 3, K - 2>::Zero();  ///< more, in the axes of the world:
                                                                        ///< gravity, say
};
/// A pose with its velocity.
template <std::floating_point Scalar>
struct ExtendedPoseParts<Scalar, 2> {
  DualQuaternion<Scalar> pose = DualQuaternion<Scalar>::identity();  ///< R and p
  Vector3<Scalar> velocity = Vector3<Scalar>::Zero();                ///< v, in the axes of the world
};
/// A pose alone.
template <std::floating_point Scalar>
struct ExtendedPoseParts<Scalar, 1> {
  DualQuaternion<Scalar> pose = DualQuaternion<Scalar>::identity();  ///< R and p
};

/// A pose with vectors that turn with it, an element of SE_K(3): by default with its velocity, {pose,
/// velocity}. For K = 3, {pose, velocity, gravity}; for K = 1 the pose alone.
///
/// R and the position p [m] are those of T_world_body, the velocity v [m/s] and all further vectors are in
/// the axes of the world. The matrices [R, v, p, ...; 0, I] form a group in which the motion by inertial
/// measurements is group-affine: errors propagate linearly however large they are. Reference: A. Barrau,
/// S. Bonnabel, "The invariant extended Kalman filter as a stable observer", IEEE TAC 2017.
///
/// Tangent vectors are xi = (phi, nu, rho, ...) [rad, m/s, m, ...]: the rotation, then one vector for every
/// column of columns(), in the axes of the body.
template <std::floating_point Scalar_, int K = 2>
requires(K >= 1) struct ExtendedPose : ExtendedPoseParts<Scalar_, K> {
  using Scalar = Scalar_;                  ///< of all coordinates
  static constexpr int kDim = 3 + 3 * K;   ///< length of the tangent vectors
  using Tangent = Vector<Scalar, kDim>;    ///< (phi, nu, rho, ...)
  using Columns = Matrix<Scalar, 3, K>;    ///< one column for every vector
  static constexpr int kPosition = K > 1;  ///< the column of the position

  /// The neutral element: no rotation, all vectors zero.
  [[nodiscard]] static ExtendedPose identity() noexcept { return {}; }

  /// v, p and the further vectors, 3 x K; for K = 1 p alone.
  [[nodiscard]] Columns columns() const noexcept {
    Columns c;
    c.col(kPosition) = this->pose.translation();
    if constexpr (K >= 2) c.col(0) = this->velocity;
    if constexpr (K >= 3) c.template rightCols<K - 2>() = this->vectors;
    return c;
  }
  /// All numbers: the eight of the pose, the velocity, and the further vectors.
  [[nodiscard]] Vector<Scalar, 5 + 3 * K> coeffs() const noexcept {
    Vector<Scalar, 5 + 3 * K> numbers;
    numbers.template head<8>() = this->pose.coeffs();
    if constexpr (K >= 2) numbers.template segment<3>(8) = this->velocity;
    if constexpr (K >= 3) numbers.template tail<3 * (K - 2)>() = this->vectors.reshaped();
    return numbers;
  }

  /// (R_1 R_2, v_1 + R_1 v_2, p_1 + R_1 p_2, ...).
  [[nodiscard]] friend ExtendedPose operator*(const ExtendedPose& a, const ExtendedPose& b) noexcept {
    return assembled(a.pose * b.pose, a.columns() + a.pose.rotation_matrix() * b.columns());
  }
  /// (R^T, -R^T v, -R^T p, ...).
  [[nodiscard]] ExtendedPose inverse() const noexcept {
    return assembled(this->pose.inverse(), -(this->pose.rotation_matrix().transpose() * columns()));
  }

  /// The exponential of xi: (Exp(phi), V nu, V rho, ...) with V = so3_left_jacobian(phi). Throws unless xi is
  /// finite.
  [[nodiscard]] static ExtendedPose exp(const std::type_identity_t<Tangent>& xi) {
    detail::require_finite("tangent vector of an extended pose is not finite", xi);
    const Matrix3<Scalar> V = so3_left_jacobian(xi.template head<3>());
    return assembled(DualQuaternion<Scalar>::exp(screw(xi, kPosition)),
                     V * xi.template tail<3 * K>().reshaped(3, K));
  }
  /// The inverse of exp, |phi| <= pi.
  [[nodiscard]] Tangent log() const noexcept {
    const Vector6<Scalar> of_pose = this->pose.log();
    Tangent xi;
    xi.template head<3>() = of_pose.template head<3>();
    const Columns logarithms = so3_left_jacobian_inverse(xi.template head<3>()) * columns();
    xi.template tail<3 * K>() = logarithms.reshaped();
    xi.template segment<3>(3 + 3 * kPosition) = of_pose.template tail<3>();
    return xi;
  }
  /// Ad(x) with x exp(xi) x^-1 = exp(Ad(x) xi).
  [[nodiscard]] Matrix<Scalar, kDim> adjoint() const noexcept {
    const Matrix3<Scalar> R = this->pose.rotation_matrix();
    const Columns c = columns();
    Matrix<Scalar, kDim> A = Matrix<Scalar, kDim>::Zero();
    A.template topLeftCorner<3, 3>() = R;
    for (int k = 0; k < K; ++k) {
      A.template block<3, 3>(3 + 3 * k, 3 + 3 * k) = R;
      A.template block<3, 3>(3 + 3 * k, 0) = skew(c.col(k)) * R;
    }
    return A;
  }

  /// x exp(xi).
  [[nodiscard]] ExtendedPose boxplus(const Tangent& xi) const { return *this * exp(xi); }
  /// log(y^-1 x), for x = *this.
  [[nodiscard]] Tangent boxminus(const ExtendedPose& y) const noexcept { return (y.inverse() * *this).log(); }

  /// Right Jacobian: exp(xi + d) = exp(xi) exp(J d) to first order in d.
  [[nodiscard]] static Matrix<Scalar, kDim> right_jacobian(const Tangent& xi) noexcept {
    return from_screws(xi, [](const Vector6<Scalar>& screw) { return se3_right_jacobian(screw); });
  }
  /// The inverse of right_jacobian(xi), for |phi| < 2 pi.
  [[nodiscard]] static Matrix<Scalar, kDim> right_jacobian_inverse(const Tangent& xi) noexcept {
    return from_screws(xi, [](const Vector6<Scalar>& screw) { return se3_right_jacobian_inverse(screw); });
  }
  /// Left Jacobian: exp(xi + d) = exp(J d) exp(xi) to first order in d.
  [[nodiscard]] static Matrix<Scalar, kDim> left_jacobian(const Tangent& xi) noexcept {
    return right_jacobian(-xi);
  }
  /// The inverse of left_jacobian(xi), for |phi| < 2 pi.
  [[nodiscard]] static Matrix<Scalar, kDim> left_jacobian_inverse(const Tangent& xi) noexcept {
    return right_jacobian_inverse(-xi);
  }

  /// (phi, the k-th vector) of xi, a tangent vector of SE(3).
  [[nodiscard]] static Vector6<Scalar> screw(const Tangent& xi, int k) noexcept {
    Vector6<Scalar> result;
    result << xi.template head<3>(), xi.template segment<3>(3 + 3 * k);
    return result;
  }

 private:
  /// The element with the given pose and columns, of which that of the position is in the pose already.
  [[nodiscard]] static ExtendedPose assembled(const DualQuaternion<Scalar>& pose, const Columns& c) noexcept {
    ExtendedPose x;
    x.pose = pose;
    if constexpr (K >= 2) x.velocity = c.col(0);
    if constexpr (K >= 3) x.vectors = c.template rightCols<K - 2>();
    return x;
  }
  /// Each of (phi, nu), (phi, rho), ... is a screw with a Jacobian [[J, 0], [Q, J]]. The result has the
  /// blocks of all.
  template <class F>
  [[nodiscard]] static Matrix<Scalar, kDim> from_screws(const Tangent& xi, F&& jacobian_of_screw) noexcept {
    Matrix<Scalar, kDim> J = Matrix<Scalar, kDim>::Zero();
    for (int k = 0; k < K; ++k) {
      const Matrix6<Scalar> of_screw = jacobian_of_screw(screw(xi, k));
      J.template topLeftCorner<3, 3>() = of_screw.template topLeftCorner<3, 3>();
      J.template block<3, 3>(3 + 3 * k, 0) = of_screw.template bottomLeftCorner<3, 3>();
      J.template block<3, 3>(3 + 3 * k, 3 + 3 * k) = of_screw.template bottomRightCorner<3, 3>();
    }
    return J;
  }
};

/// Extended poses by x exp(xi), xi = (phi, nu, rho, ...) [rad, m/s, m, ...] in the axes of the body. For
/// inertial navigation: the propagation is linear for errors of any size, a position measurement only for
/// small errors of the rotation.
template <std::floating_point Scalar_, int K = 2>
struct ExtendedPoseChart {
  using Scalar = Scalar_;                   ///< of the vectors
  using Point = ExtendedPose<Scalar, K>;    ///< the poses with their velocities
  static constexpr int kDim = Point::kDim;  ///< length of the vectors
  using Tangent = typename Point::Tangent;  ///< (phi, nu, rho, ...)
  using Square = Matrix<Scalar, kDim>;      ///< covariances and Jacobians

  /// x exp(xi).
  [[nodiscard]] static Point retract(const Point& x, const Tangent& xi) { return x.boxplus(xi); }
  /// log(x^-1 y).
  [[nodiscard]] static Tangent local(const Point& x, const Point& y) noexcept { return y.boxminus(x); }
  /// The right Jacobian of SE_K(3).
  [[nodiscard]] static Square jacobian(const Tangent& xi) noexcept { return Point::right_jacobian(xi); }
  /// The inverse of jacobian(xi).
  [[nodiscard]] static Square jacobian_inverse(const Tangent& xi) noexcept {
    return Point::right_jacobian_inverse(xi);
  }
  /// Rotations by at most half a turn.
  [[nodiscard]] static bool contains(const Tangent& xi) noexcept {
    return xi.template head<3>().norm() <= std::numbers::pi_v<Scalar>;
  }
  /// x with a pose on the Study quadric, without rounding errors.
  [[nodiscard]] static Point normalized(const Point& x) {
    Point result = x;
    result.pose = x.pose.renormalized();
    return result;
  }
  /// Throws std::invalid_argument unless pose, velocity and all further vectors are finite.
  static void require_finite(const Point& x) {
    ScrewChart<Scalar>::require_finite(x.pose);
    if constexpr (K >= 2) detail::require_finite("velocity is not finite", x.velocity);
    if constexpr (K >= 3) detail::require_finite("vectors of an extended pose are not finite", x.vectors);
  }
};

}  // namespace antipode
