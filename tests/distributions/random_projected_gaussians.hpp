// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>

#include "support/random.hpp"

namespace antipode::test {

/// Variances of u up to sigma_u^2 and of t up to sigma_t^2, correlated.
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> random_tangent_covariance(Rng& rng, double sigma_u, double sigma_t) {
  Vector6<Scalar> scale;
  scale << Vector3<Scalar>::Constant(static_cast<Scalar>(sigma_u)),
      Vector3<Scalar>::Constant(static_cast<Scalar>(sigma_t));
  const Matrix6<Scalar> S = random_covariance<Scalar, 6>(rng);
  Matrix6<Scalar> scaled;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) scaled(i, j) = scaled(j, i) = scale[i] * S(i, j) * scale[j];
  }
  return scaled;
}

/// A density centred at `mode`.
template <class Density = ProjectedGaussian<double>, class Scalar = typename Density::Scalar>
[[nodiscard]] Density random_density_at(Rng& rng, const DualQuaternion<Scalar>& mode, double sigma_u,
                                        double sigma_t) {
  return Density(mode, random_tangent_covariance<Scalar>(rng, sigma_u, sigma_t));
}

/// The pose `mode` moved by a turn of `angle` [rad] and at most `distance` along each axis.
template <class Scalar>
[[nodiscard]] DualQuaternion<Scalar> nearby_pose(Rng& rng, const DualQuaternion<Scalar>& mode, double angle,
                                                 double distance) {
  return mode.boxplus(random_twist<Scalar>(rng, angle, distance));
}

/// The same density with the other sign of the tangent point.
template <class Density>
[[nodiscard]] Density with_flipped_sign(const Density& x) {
  return Density(-x.tangent_point(), x.mean(), x.covariance());
}

}  // namespace antipode::test
