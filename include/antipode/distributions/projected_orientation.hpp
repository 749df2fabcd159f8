// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <random>
#include <stdexcept>

#include <antipode/detail/cholesky.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/distributions/gaussian.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// The orientation of a projected Gaussian by itself.
namespace antipode {

/// The orientation of a projected Gaussian by itself: its exact marginal density on S^3.
///
/// p(q) = N(u; mu_u, Sigma_uu) / (2 C), or times (1 + |u|^2)^2 / 2 for the push-forward (see
/// BasicProjectedGaussian).
template <std::floating_point Scalar_, Projection kProjection_>
class ProjectedOrientation {
 public:
  using Scalar = Scalar_;                                  ///< of coordinates and densities
  static constexpr Projection kProjection = kProjection_;  ///< which of the two densities

  /// The marginal of a density of poses.
  explicit ProjectedOrientation(const BasicProjectedGaussian<Scalar, kProjection>& pose)
      : tangent_point_(pose.tangent_point()),
        u_(pose.mean().template head<3>(), pose.covariance().template topLeftCorner<3, 3>()),
        log_normalizer_(pose.log_normalizer()) {}

  /// q0; -q0 is the same tangent space.
  [[nodiscard]] const Vector4<Scalar>& tangent_point() const noexcept { return tangent_point_; }
  /// The Gaussian of the coordinates u on the tangent space.
  [[nodiscard]] const Gaussian<Scalar, 3>& tangent_gaussian() const noexcept { return u_; }

  /// log p(q), for q of unit length (not checked); -infinity a half-turn away from the tangent point. Throws
  /// std::domain_error if the covariance of u is singular.
  [[nodiscard]] Scalar log_density(const Vector4<Scalar>& q) const {
    using std::log1p;
    const auto u = detail::tangent_coordinates(tangent_point_, q);
    using Limits = std::numeric_limits<Scalar>;
    if (!u) return q.hasNaN() ? Limits::quiet_NaN() : -Limits::infinity();
    const Scalar value = u_.log_density(*u) - log_normalizer_;
    return kProjection == Projection::kRenormalized ? value : value + Scalar(2) * log1p(u->squaredNorm());
  }

 private:
  Vector4<Scalar> tangent_point_;
  Gaussian<Scalar, 3> u_;
  Scalar log_normalizer_;
};

}  // namespace antipode
