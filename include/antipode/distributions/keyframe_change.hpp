// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <tuple>
#include <type_traits>

#include <antipode/detail/check.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/extended_pose.hpp>
#include <antipode/geometry/jacobians.hpp>

/// @file
/// A state relative to a keyframe: taking the body as the next keyframe, and keeping the length of gravity.
namespace antipode {

/// The result of change_keyframe().
template <Chart C>
struct KeyframeChange {
  using Scalar = typename C::Scalar;  ///< of all numbers

  StateGaussian<C> state;     ///< relative to the new keyframe: its pose is exactly the identity
  PoseGaussian<Scalar> link;  ///< T_old_new, the pose of the new keyframe in the old one
  /// Covariance of the vector of `state` with that of `link`. Successive links are correlated through it:
  /// velocity, gravity and biases of the state go on into the next one.
  Matrix<Scalar, C::kDim, 6> cross;
};

/// The state relative to the body itself, which becomes the new keyframe: (R, v, p, g) of T_old_body turns
/// to (I, R^T v, 0, R^T g), and so do further vectors of the ExtendedPose. Other parts of the state do not
/// change: biases, a time offset, or a pose relative to the body.
///
/// To first order, with u = R^T v, the error (phi, nu, rho, gamma) becomes (0, nu + [u] phi, 0, gamma + [R^T
/// g] phi). Rotation and position of the old state are the link. The new covariance is singular: predict with
/// noise before updates that need a regular one. Throws unless the covariance is finite and symmetric.
template <std::floating_point Scalar, int K, Chart... Others>
[[nodiscard]] auto change_keyframe(
    const StateGaussian<ProductChart<ExtendedPoseChart<Scalar, K>, Others...>>& old) {
  using C = ProductChart<ExtendedPoseChart<Scalar, K>, Others...>;
  using Navigation = ExtendedPose<Scalar, K>;
  constexpr int N = C::kDim, kRho = 3 + 3 * Navigation::kPosition;
  detail::require_symmetric(old);
  KeyframeChange<C> change{.state = old, .link = {}, .cross = {}};

  const auto& x = std::get<0>(old.state);
  Navigation& moved = std::get<0>(change.state.state);
  moved = Navigation{DualQuaternion<Scalar>::from_rotation_translation(x.pose.rotation(),
                                                                       Vector3<Scalar>::Zero())}
              .inverse() *
          x;
  Matrix<Scalar, N> T = Matrix<Scalar, N>::Identity();
  const auto columns = moved.columns();
  for (int k = 0; k < K; ++k) T.template block<3, 3>(3 + 3 * k, 0) = skew(columns.col(k));
  T.template topRows<3>().setZero();
  T.template middleRows<3>(kRho).setZero();
  moved.pose = DualQuaternion<Scalar>::identity();

  Matrix<Scalar, N, 6> with_pose;
  with_pose << old.covariance.template leftCols<3>(), old.covariance.template middleCols<3>(kRho);
  change.link.pose = x.pose;
  change.link.covariance << with_pose.template topRows<3>(), with_pose.template middleRows<3>(kRho);
  change.cross = T * with_pose;
  change.state.covariance = detail::congruence<Scalar, N, N>(T, old.covariance);
  return change;
}

/// The state with a gravity of exactly the given length [m/s^2], of which only the direction is uncertain:
/// the covariance along gravity is zero. For ExtendedPose{pose, velocity, gravity}. An update along the
/// tangent of the sphere of directions leaves it to second order; call this after every update. Throws unless
/// the length is positive and finite and gravity is not zero.
template <std::floating_point Scalar, Chart... Others>
[[nodiscard]] StateGaussian<ProductChart<ExtendedPoseChart<Scalar, 3>, Others...>> with_gravity_length(
    StateGaussian<ProductChart<ExtendedPoseChart<Scalar, 3>, Others...>> state,
    std::type_identity_t<Scalar> length) {
  constexpr int N = ProductChart<ExtendedPoseChart<Scalar, 3>, Others...>::kDim, kGamma = 9;
  auto& x = std::get<0>(state.state);
  const Scalar norm = x.vectors.norm();
  if (!(length > Scalar(0)) || !detail::is_finite(length)) [[unlikely]] {
    detail::throw_invalid("length of gravity is not positive and finite", length);
  }
  if (!(norm > Scalar(0)) || !detail::is_finite(norm)) [[unlikely]] {
    detail::throw_invalid("gravity of the state is zero or not finite", x.vectors);
  }
  const Vector3<Scalar> along = x.pose.rotation_matrix().transpose() * (x.vectors.col(0) / norm);
  x.vectors *= length / norm;
  Matrix<Scalar, N> across = Matrix<Scalar, N>::Identity();
  across.template block<3, 3>(kGamma, kGamma) -= along * along.transpose();
  state.covariance = detail::congruence<Scalar, N, N>(across, state.covariance);
  return state;
}

}  // namespace antipode
