// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <numbers>

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/jacobians.hpp>

/// @file
/// Poses with a velocity, SE_2(3).
namespace antipode {

/// A pose with its velocity, an element of SE_2(3): the rotation R of T_world_body, the velocity v [m/s] and
/// the position p [m], both in the axes of the world.
///
/// The matrices [R, v, p; 0, 1, 0; 0, 0, 1] form a group in which the motion by inertial measurements is
/// group-affine: errors propagate linearly however large they are. Reference: A. Barrau, S. Bonnabel, "The
/// invariant extended Kalman filter as a stable observer", IEEE TAC 2017.
template <std::floating_point Scalar_>
struct ExtendedPose {
  using Scalar = Scalar_;  ///< of all coordinates

  DualQuaternion<Scalar> pose = DualQuaternion<Scalar>::identity();  ///< R and p
  Vector3<Scalar> velocity = Vector3<Scalar>::Zero();                ///< v, in the axes of the world

  /// (R_1 R_2, v_1 + R_1 v_2, p_1 + R_1 p_2).
  [[nodiscard]] friend ExtendedPose operator*(const ExtendedPose& a, const ExtendedPose& b) noexcept {
    return {a.pose * b.pose, a.velocity + a.pose.rotation_matrix() * b.velocity};
  }
  /// (R^T, -R^T v, -R^T p).
  [[nodiscard]] ExtendedPose inverse() const noexcept {
    return {pose.inverse(), -(pose.rotation_matrix().transpose() * velocity)};
  }

  /// The exponential of xi = (phi, nu, rho) [rad, m/s, m]: (Exp(phi), V nu, V rho) with
  /// V = so3_left_jacobian(phi). Throws unless xi is finite.
  [[nodiscard]] static ExtendedPose exp(const Vector<Scalar, 9>& xi) {
    detail::require_finite("tangent vector of an extended pose is not finite", xi);
    Vector6<Scalar> screw;
    screw << xi.template head<3>(), xi.template tail<3>();
    return {DualQuaternion<Scalar>::exp(screw),
            so3_left_jacobian(xi.template head<3>()) * xi.template segment<3>(3)};
  }
  /// The inverse of exp, |phi| <= pi.
  [[nodiscard]] Vector<Scalar, 9> log() const noexcept {
    const Vector6<Scalar> screw = pose.log();
    const Vector3<Scalar> phi = screw.template head<3>();
    Vector<Scalar, 9> xi;
    xi << phi, so3_left_jacobian_inverse(phi) * velocity, screw.template tail<3>();
    return xi;
  }
  /// Ad(x) with x exp(xi) x^-1 = exp(Ad(x) xi).
  [[nodiscard]] Matrix<Scalar, 9> adjoint() const noexcept {
    const Matrix3<Scalar> R = pose.rotation_matrix();
    Matrix<Scalar, 9> A = Matrix<Scalar, 9>::Zero();
    A.template block<3, 3>(0, 0) = A.template block<3, 3>(3, 3) = A.template block<3, 3>(6, 6) = R;
    A.template block<3, 3>(3, 0) = skew(velocity) * R;
    A.template block<3, 3>(6, 0) = skew(pose.translation()) * R;
    return A;
  }
};

/// Extended poses by x exp(xi), xi = (phi, nu, rho) [rad, m/s, m] in the axes of the body. For inertial
/// navigation: the propagation is linear for errors of any size, a position measurement only for small errors
/// of the rotation.
template <std::floating_point Scalar_>
struct ExtendedPoseChart {
  using Scalar = Scalar_;              ///< of the vectors
  using Point = ExtendedPose<Scalar>;  ///< the poses with their velocities
  static constexpr int kDim = 9;       ///< length of the vectors
  using Tangent = Vector<Scalar, 9>;   ///< (phi, nu, rho)

  /// x exp(xi).
  [[nodiscard]] static Point retract(const Point& x, const Tangent& xi) { return x * Point::exp(xi); }
  /// log(x^-1 y).
  [[nodiscard]] static Tangent local(const Point& x, const Point& y) noexcept {
    return (x.inverse() * y).log();
  }
  /// The right Jacobian of SE_2(3), 9 x 9.
  [[nodiscard]] static Matrix<Scalar, 9> jacobian(const Tangent& xi) noexcept {
    return from_screws(xi, [](const Vector6<Scalar>& screw) { return se3_right_jacobian(screw); });
  }
  /// The inverse of jacobian(xi).
  [[nodiscard]] static Matrix<Scalar, 9> jacobian_inverse(const Tangent& xi) noexcept {
    return from_screws(xi, [](const Vector6<Scalar>& screw) { return se3_right_jacobian_inverse(screw); });
  }
  /// Rotations by at most half a turn.
  [[nodiscard]] static bool contains(const Tangent& xi) noexcept {
    return xi.template head<3>().norm() <= std::numbers::pi_v<Scalar>;
  }
  /// x with a pose on the Study quadric, without rounding errors.
  [[nodiscard]] static Point normalized(const Point& x) { return {x.pose.renormalized(), x.velocity}; }
  /// Throws std::invalid_argument unless pose and velocity are finite.
  static void require_finite(const Point& x) {
    ScrewChart<Scalar>::require_finite(x.pose);
    detail::require_finite("velocity is not finite", x.velocity);
  }

 private:
  /// Each of (phi, nu) and (phi, rho) is a screw with a Jacobian [[J, 0], [Q, J]]. The result has the blocks
  /// of both.
  template <class F>
  [[nodiscard]] static Matrix<Scalar, 9> from_screws(const Tangent& xi, F&& jacobian_of_screw) noexcept {
    Vector6<Scalar> screw = xi.template head<6>();
    const Matrix6<Scalar> of_velocity = jacobian_of_screw(screw);
    screw.template tail<3>() = xi.template tail<3>();
    const Matrix6<Scalar> of_position = jacobian_of_screw(screw);
    Matrix<Scalar, 9> J = Matrix<Scalar, 9>::Zero();
    J.template topLeftCorner<6, 6>() = of_velocity;
    J.template bottomLeftCorner<3, 3>() = of_position.template bottomLeftCorner<3, 3>();
    J.template bottomRightCorner<3, 3>() = of_position.template bottomRightCorner<3, 3>();
    return J;
  }
};

}  // namespace antipode
