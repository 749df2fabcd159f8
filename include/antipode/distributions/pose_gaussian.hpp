// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

namespace antipode {

/// A concentrated pose density: the pose is mean * exp(xi), xi = (phi, rho) ~ N(0, covariance), rotation
/// first.
///
/// Plain data, for filters that work on the tangent space; BinghamGaussian is the density of SE(3) itself,
/// valid for wide orientations too. The two convert into each other, to first order in the rotation's
/// covariance.
template <std::floating_point Scalar_>
struct PoseGaussian {
  using Scalar = Scalar_;

  DualQuaternion<Scalar> pose = DualQuaternion<Scalar>::identity();
  Matrix6<Scalar> covariance = Matrix6<Scalar>::Zero();  ///< of xi: rad^2, rad m, m^2
};

template <std::floating_point Scalar>
[[nodiscard]] PoseGaussian<Scalar> to_pose_gaussian(const BinghamGaussian<Scalar>& density) {
  return {density.pose(), density.covariance()};
}

/// Throws unless the covariance is symmetric positive semidefinite and narrow enough for its pose to be the
/// mode. By default second moments of the orientation are raised to no more than 1e-14 (2e-7 rad).
template <std::floating_point Scalar>
[[nodiscard]] BinghamGaussian<Scalar> to_bingham_gaussian(const PoseGaussian<Scalar>& density,
                                                          const BinghamFitOptions<Scalar>& options = {
                                                              .min_eigenvalue = Scalar(1e-14)}) {
  return BinghamGaussian<Scalar>::from_pose_covariance(density.pose, density.covariance, options);
}

}  // namespace antipode
