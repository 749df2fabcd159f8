// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>

#include <antipode/detail/check.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/quaternion.hpp>

/// @file
/// Pose covariances as other libraries write them. Three things differ: the order of rotation and
/// translation, the side on which the error is applied, and the axes it is given in.
///
/// | library          | error model                 | order                 | rotation | translation   |
/// |------------------|-----------------------------|-----------------------|----------|---------------|
/// | antipode         | T exp(xi)                   | rotation, translation | body     | body          |
/// | GTSAM (Pose3)    | T exp(xi)                   | rotation, translation | body     | body          |
/// | Sophus, manif    | T exp(xi)                   | translation, rotation | body     | body          |
/// | "left" in papers | exp(xi) T                   | rotation, translation | parent   | parent, lever |
/// | ROS              | R' = exp(phi) R, t' = t + d | translation, rotation | parent   | parent        |
///
/// The last two columns give the axes of both parts of the error. "Sophus, manif" means the class SE3 of
/// either, perturbed on the right; "ROS" means geometry_msgs/PoseWithCovariance. With "lever", the rotation
/// of the error is about the origin of the parent frame and moves the position.
///
/// The conversions are linear maps of the error, exact to first order in it. The classic mistake is to take
/// the ROS covariance for that of the left perturbation exp(xi) T, which turns about the origin of the parent
/// frame: there, a heading error of 1 mrad at 100 m from the origin includes a position error of 10 cm.
///
/// Every function throws std::invalid_argument, with the matrix, unless the covariance is finite, symmetric
/// and positive semidefinite. If only one triangle of yours is set, copy it to the other one.
namespace antipode {

namespace detail {

/// P. Throws unless it is symmetric and positive semidefinite.
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> checked_pose_covariance(const Matrix6<Scalar>& P) {
  Matrix6<Scalar> symmetric =
      checked_covariance<Scalar, 6>("pose covariance is not finite or not symmetric", P);
  (void)root_of_covariance<Scalar, 6>("pose covariance has a negative eigenvalue", symmetric);
  return symmetric;
}

/// The covariance of the error with rotation and translation in the other order.
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> with_blocks_swapped(const Matrix6<Scalar>& P) {
  Matrix6<Scalar> swapped;
  for (int j = 0; j < 6; ++j) {
    for (int i = 0; i < 6; ++i) swapped(i, j) = P((i + 3) % 6, (j + 3) % 6);
  }
  return swapped;
}

/// blkdiag(R, R) P blkdiag(R, R)^T.
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> with_axes_turned(const Matrix3<Scalar>& R, const Matrix6<Scalar>& P) {
  Matrix6<Scalar> A = Matrix6<Scalar>::Zero();
  A.template topLeftCorner<3, 3>() = R;
  A.template bottomRightCorner<3, 3>() = R;
  return congruence<Scalar, 6, 6>(A, P);
}

}  // namespace detail

/// The covariance in the tangent space of gtsam::Pose3, which is that of this library.
template <std::floating_point Scalar>
[[nodiscard]] Matrix6<Scalar> to_gtsam_covariance(const PoseGaussian<Scalar>& x) {
  return detail::checked_pose_covariance<Scalar>(x.covariance);
}
/// The density with the given covariance in the tangent space of gtsam::Pose3.
template <std::floating_point Scalar>
[[nodiscard]] PoseGaussian<Scalar> from_gtsam_covariance(const DualQuaternion<Scalar>& pose,
                                                         const Matrix6<Scalar>& covariance) {
  return {pose, detail::checked_pose_covariance<Scalar>(covariance)};
}

/// The covariance of T * exp(xi) with the translation first: Sophus::SE3 perturbed on the right, manif::SE3.
template <std::floating_point Scalar>
[[nodiscard]] Matrix6<Scalar> to_sophus_covariance(const PoseGaussian<Scalar>& x) {
  return detail::with_blocks_swapped<Scalar>(detail::checked_pose_covariance<Scalar>(x.covariance));
}
/// The density with the covariance of T * exp(xi), translation first.
template <std::floating_point Scalar>
[[nodiscard]] PoseGaussian<Scalar> from_sophus_covariance(const DualQuaternion<Scalar>& pose,
                                                          const Matrix6<Scalar>& covariance) {
  return {pose, detail::with_blocks_swapped<Scalar>(detail::checked_pose_covariance<Scalar>(covariance))};
}

/// The covariance of exp(xi) * T, rotation first: exp(Ad(T) xi) T = T exp(xi).
template <std::floating_point Scalar>
[[nodiscard]] Matrix6<Scalar> to_left_covariance(const PoseGaussian<Scalar>& x) {
  return detail::congruence<Scalar, 6, 6>(x.pose.adjoint(),
                                          detail::checked_pose_covariance<Scalar>(x.covariance));
}
/// The density with the covariance of exp(xi) * T, rotation first.
template <std::floating_point Scalar>
[[nodiscard]] PoseGaussian<Scalar> from_left_covariance(const DualQuaternion<Scalar>& pose,
                                                        const Matrix6<Scalar>& covariance) {
  return {pose, detail::congruence<Scalar, 6, 6>(pose.inverse().adjoint(),
                                                 detail::checked_pose_covariance<Scalar>(covariance))};
}

/// The 36 numbers of geometry_msgs/PoseWithCovariance: row by row, of (x, y, z, rotation about x, y, z), all
/// along the fixed axes of the parent frame.
template <std::floating_point Scalar>
[[nodiscard]] std::array<Scalar, 36> to_ros_covariance(const PoseGaussian<Scalar>& x) {
  const Matrix6<Scalar> P = detail::with_blocks_swapped<Scalar>(detail::with_axes_turned<Scalar>(
      x.pose.rotation_matrix(), detail::checked_pose_covariance<Scalar>(x.covariance)));
  std::array<Scalar, 36> rows;
  for (std::size_t k = 0; k < 36; ++k) rows[k] = P(static_cast<int>(k / 6), static_cast<int>(k % 6));
  return rows;
}
/// Whether the covariance of a ROS message is known. By ROS's conventions it is not if all its numbers are
/// zero, and if the first one is -1 the sensor does not measure the quantity (sensor_msgs/Imu).
template <std::floating_point Scalar, std::size_t Count>
[[nodiscard]] bool ros_covariance_is_known(const std::array<Scalar, Count>& rows) noexcept {
  return rows[0] != Scalar(-1) && std::any_of(rows.begin(), rows.end(), [](Scalar x) { return x != 0; });
}
/// The density with the 36 numbers of geometry_msgs/PoseWithCovariance, see to_ros_covariance(). Throws also
/// if they are not known, see ros_covariance_is_known(): taken at their word, they are those of an exact
/// pose.
template <std::floating_point Scalar>
[[nodiscard]] PoseGaussian<Scalar> from_ros_covariance(const DualQuaternion<Scalar>& pose,
                                                       const std::array<Scalar, 36>& rows) {
  Matrix6<Scalar> P;
  for (std::size_t k = 0; k < 36; ++k) P(static_cast<int>(k / 6), static_cast<int>(k % 6)) = rows[k];
  if (!ros_covariance_is_known(rows)) [[unlikely]] {
    detail::throw_invalid("covariance of a ROS message is unknown (all zeros, or -1 first); use your own", P);
  }
  const Matrix3<Scalar> R = pose.rotation_matrix();
  return {pose, detail::with_axes_turned<Scalar>(
                    R.transpose(),
                    detail::with_blocks_swapped<Scalar>(detail::checked_pose_covariance<Scalar>(P)))};
}

}  // namespace antipode
