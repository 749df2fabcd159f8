// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>

#include <antipode/detail/check.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/detail/hemisphere_mass.hpp>
#include <antipode/distributions/detail/tangent_moments.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/quaternion.hpp>

/// @file
/// Conversions between projected Gaussians and other pose densities, and their fit to weighted poses.
namespace antipode {

// --- Gaussian in exponential coordinates. xi = (phi, rho) = (2 u, R^T (t - mu_t)) to first order in u.

/// The PoseGaussian at the mode with the covariance of xi. to_projected_gaussian() gives the density back
/// without loss.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] PoseGaussian<Scalar> to_pose_gaussian(
    const BasicProjectedGaussian<Scalar, kProjection>& density) {
  const auto x = density.centered();
  Matrix6<Scalar> A = Matrix6<Scalar>::Identity() * Scalar(2);
  A.template bottomRightCorner<3, 3>() = rotation_matrix(x.tangent_point()).transpose();
  return {x.pose(), detail::symmetrized(detail::congruence<Scalar, 6, 6>(A, x.covariance()))};
}

/// The inverse of to_pose_gaussian(). Throws unless the covariance is symmetric and positive semidefinite.
template <Projection kProjection = Projection::kRenormalized, std::floating_point Scalar>
[[nodiscard]] BasicProjectedGaussian<Scalar, kProjection> to_projected_gaussian(
    const PoseGaussian<Scalar>& density) {
  Matrix6<Scalar> A = Matrix6<Scalar>::Identity() * Scalar(0.5);
  A.template bottomRightCorner<3, 3>() = density.pose.rotation_matrix();
  return {density.pose, detail::congruence<Scalar, 6, 6>(A, density.covariance)};
}

// --- Bingham density with a coupled Gaussian. In the axes B of the Bingham density about its mode the
// coordinates u have the variances lambda_i = omega_i / omega_4, and E[t | u] = mu_t + G B^T u has the slope
// and the conditional covariance that BinghamGaussian has at the mode:
//
//   Sigma_uu = B Lambda B^T,   Sigma_tu = G Lambda B^T,   Sigma_tt = Sc + G Lambda G^T

namespace detail {

template <class Scalar>
[[nodiscard]] Vector3<Scalar> tangent_variances(const Bingham<Scalar, 4>& orientation) {
  return orientation.second_moments().template head<3>() / orientation.second_moments()[3];
}

}  // namespace detail

/// The BinghamGaussian of a projected Gaussian. to_projected_gaussian() gives the density back without loss.
/// Throws if the rotation is too wide for q0 to be the mode: an eigenvalue of Sigma_uu above 1. Second
/// moments of the orientation below min_eigenvalue are raised to it.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] BinghamGaussian<Scalar> to_bingham_gaussian(
    const BasicProjectedGaussian<Scalar, kProjection>& density,
    const BinghamFitOptions<Scalar>& options = {.min_eigenvalue = Scalar(1e-14)}) {
  const auto x = density.centered();
  const Matrix6<Scalar>& Sigma = x.covariance();
  const auto eigen = detail::symmetric_eigen<Scalar, 3>(Sigma.template topLeftCorner<3, 3>());
  if (!(eigen.values[2] <= Scalar(1))) [[unlikely]] {
    detail::throw_invalid("rotation is too wide for a Bingham density about the mode, variances of u",
                          eigen.values);
  }
  const Matrix4<Scalar> L = left_matrix(x.tangent_point());
  Matrix4<Scalar> axes;
  axes << L.template rightCols<3>() * eigen.vectors, x.tangent_point();
  Vector4<Scalar> moments;
  moments << eigen.values.cwiseMax(Scalar(0)), Scalar(1);
  const auto orientation = Bingham<Scalar, 4>::from_moments(axes, moments / moments.sum(), options);

  const Vector3<Scalar> lambda = detail::tangent_variances(orientation);
  const Matrix3<Scalar> tu = Sigma.template bottomLeftCorner<3, 3>();
  Matrix3<Scalar> G = tu * detail::tangent_axes(orientation);
  for (int i = 0; i < 3; ++i) G.col(i) /= lambda[i];
  const Matrix3<Scalar> tt = Sigma.template bottomRightCorner<3, 3>();
  const Matrix3<Scalar> Sc = tt - detail::scaled_square<Scalar, 3, 3>(G, lambda);
  return {orientation, x.mean().template tail<3>(), G, detail::without_negative_eigenvalues(Sc)};
}

/// The projected Gaussian at the mode. Nothing is lost if the orientation is concentrated; a uniform one gets
/// variances of 1.
template <Projection kProjection = Projection::kRenormalized, std::floating_point Scalar>
[[nodiscard]] BasicProjectedGaussian<Scalar, kProjection> to_projected_gaussian(
    const BinghamGaussian<Scalar>& density) {
  Matrix<Scalar, 6, 3> slope;
  slope << detail::tangent_axes(density.orientation()), density.coupling();
  Matrix6<Scalar> Sigma =
      detail::scaled_square<Scalar, 6, 3>(slope, detail::tangent_variances(density.orientation()));
  Sigma.template bottomRightCorner<3, 3>() += density.conditional_covariance();
  return {density.pose(), Sigma};
}

// --- The two projections of the Gaussian. With the same parameters (the explicit constructor) they differ by
// a factor (1 + |u|^2)^2, which matters for wide rotations. The following functions keep the moments of (u,
// t) instead.

namespace detail {

/// The Gaussian y with mean m and covariance S of u instead of its own; t given u has the same density as
/// before.
template <class Scalar>
[[nodiscard]] TangentGaussian<Scalar> with_rotation_moments(const TangentGaussian<Scalar>& y,
                                                            const Vector3<Scalar>& m,
                                                            const Matrix3<Scalar>& S) {
  // y = (I; slope) u + rest: only the moments of (I; slope) u change.
  const Matrix3<Scalar> uu = y.covariance.template topLeftCorner<3, 3>();
  const Matrix3<Scalar> tu = y.covariance.template bottomLeftCorner<3, 3>();
  Matrix<Scalar, 6, 3> slope;
  slope << Matrix3<Scalar>::Identity(), tu * pseudo_inverse(uu);
  const Vector3<Scalar> shift = m - y.mean.template head<3>();
  return {y.mean + slope * shift,
          symmetrized<Scalar, 6>(y.covariance + congruence<Scalar, 6, 3>(slope, S - uu))};
}

}  // namespace detail

/// The push-forward density with the moments of (u, t) of a renormalised one, in the same tangent space.
template <std::floating_point Scalar>
[[nodiscard]] PushForwardGaussian<Scalar> match_push_forward(const ProjectedGaussian<Scalar>& x) {
  const Matrix3<Scalar> uu = x.covariance().template topLeftCorner<3, 3>();
  const auto tilted = detail::tilted_moments<double>(x.mean().template head<3>().template cast<double>(),
                                                     uu.template cast<double>());
  Matrix3<double> S = tilted.second_moment;
  detail::add_outer_product(-1.0, tilted.mean, tilted.mean, S);
  const auto y = detail::with_rotation_moments<Scalar>(x.parameters(), tilted.mean.template cast<Scalar>(),
                                                       S.template cast<Scalar>());
  return {x.tangent_point(), y.mean, y.covariance};
}

/// The renormalised density with the moments of (u, t) of a push-forward one; none if the rotation is too
/// wide. If only one axis is uncertain, for example, no renormalised density has a variance of u above 1.
template <std::floating_point Scalar>
[[nodiscard]] std::optional<ProjectedGaussian<Scalar>> match_renormalized(
    const PushForwardGaussian<Scalar>& density) {
  constexpr int kMaxIterations = 200;
  constexpr double kTolerance = 1e-10;
  const auto x = density.centered();
  const Matrix3<Scalar> uu = x.covariance().template topLeftCorner<3, 3>();
  const auto target = detail::symmetric_eigen<double, 3>(uu.template cast<double>());
  Vector3<double> wanted = target.values;
  for (int i = 0; i < 3; ++i) wanted[i] = std::max(wanted[i], 0.0);
  Vector3<double> lambda = wanted;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Matrix3<double> tilted =
        detail::tilted_moments<double>(Vector3<double>::Zero(), lambda.asDiagonal()).second_moment;
    const Vector3<double> got(tilted(0, 0), tilted(1, 1), tilted(2, 2));
    bool matched = true;
    for (int i = 0; i < 3; ++i) matched &= std::abs(got[i] - wanted[i]) <= kTolerance * wanted[i];
    if (matched) {
      const Matrix3<double> S = detail::scaled_square<double, 3, 3>(target.vectors, lambda);
      const auto y = detail::with_rotation_moments<Scalar>(x.parameters(), Vector3<Scalar>::Zero(),
                                                           S.template cast<Scalar>());
      return ProjectedGaussian<Scalar>(x.tangent_point(), y.mean, y.covariance);
    }
    for (int i = 0; i < 3; ++i) lambda[i] *= wanted[i] > 0.0 ? wanted[i] / got[i] : 1.0;
    if (!(lambda.sum() <= static_cast<double>(ProjectedGaussian<Scalar>::kMaxSpread))) break;
  }
  return std::nullopt;
}

// --- Fit to samples.

/// The push-forward density with the mean and the covariance of weighted poses (the columns [q; p]; the
/// weights need not be normalised) in the tangent space at their mode: the maximum-likelihood fit. Throws on
/// weights that are negative or sum to zero, on anything not finite, and if the iteration finds no tangent
/// point at which the mean of u is zero.
template <class Points, class Weights>
requires(Points::RowsAtCompileTime == 8)
    [[nodiscard]] PushForwardGaussian<typename Points::Scalar> fit_projected_gaussian(
        const Eigen::MatrixBase<Points>& points, const Eigen::MatrixBase<Weights>& weights) {
  using Scalar = typename Points::Scalar;
  using std::sqrt;
  constexpr int kMaxIterations = 50;
  const Scalar rounding = Scalar(16) * std::numeric_limits<Scalar>::epsilon();
  const detail::PoseSample<Scalar> poses(points, weights, Scalar(1));
  Vector6<Scalar> reference = detail::centered_mean(detail::mean_translation<Scalar>(poses, poses.weights));
  Vector4<Scalar> q = detail::mean_rotation<Scalar>(poses, poses.weights);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const detail::TangentMoments<Scalar> moments(q, poses, poses.weights, reference);
    const Vector3<Scalar> u = moments.density.mean.template head<3>();
    const Matrix6<Scalar>& Sigma = moments.density.covariance;
    const Scalar spread = sqrt(Sigma(0, 0) + Sigma(1, 1) + Sigma(2, 2));
    if (u.norm() <= rounding + rounding * spread) {
      reference.template tail<3>() = moments.density.mean.template tail<3>();
      return {q, reference, detail::without_rounding<Scalar, 6>(Sigma)};
    }
    q = detail::central_projection<Scalar>(q, u * std::min(Scalar(1), Scalar(0.5) / u.norm()));
  }
  detail::throw_invalid("the rotations of the samples have no mode, last at", q);
}

}  // namespace antipode
