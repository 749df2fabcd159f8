// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

namespace antipode {

/// A concentrated pose density: the pose is mean * exp(xi), xi = (phi, rho) ~ N(0, covariance), rotation
/// first.
///
/// Plain data, for filters that work on the tangent space; BinghamGaussian is the density of SE(3) itself,
/// valid for wide orientations too. to_pose_gaussian() and to_bingham_gaussian() convert between the two, to
/// first order in the rotation's covariance.
template <std::floating_point Scalar_>
struct PoseGaussian {
  using Scalar = Scalar_;

  DualQuaternion<Scalar> pose = DualQuaternion<Scalar>::identity();
  Matrix6<Scalar> covariance = Matrix6<Scalar>::Zero();  ///< of xi: rad^2, rad m, m^2
};

}  // namespace antipode
