// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/jacobians.hpp>
#include <antipode/geometry/quaternion.hpp>

/// @file
/// Operations on projected Gaussians: fusion of two densities of the same pose, composition of independent
/// poses, inversion. The results are centred at their modes (PG0). MPG sec. III-C.
namespace antipode {

/// Which densities may be fused, and how they are carried to a common tangent space.
template <std::floating_point Scalar>
struct FusionOptions {
  /// Largest angle between the tangent points [rad on S^3]. The default of 15 degrees is a rotation by 30
  /// degrees.
  Scalar max_angle = std::numbers::pi_v<Scalar> / Scalar(12);
  Transport transport = Transport::kLinearized;  ///< to the tangent space half way
};

/// The normalised product of two densities.
template <class Density>
struct Fusion {
  using Scalar = typename Density::Scalar;  ///< of coordinates and densities

  Density density;  ///< the product, centred at its mode
  /// log of the integral of the product over S^3 x R^3: how well the two agree.
  Scalar log_mass;
  /// Squared Mahalanobis distance of the two means; the paper's delta is exp(-mahalanobis_squared / 2).
  Scalar mahalanobis_squared;
  /// A bound on the error of the log density that linearised changes of the tangent space cause: its root
  /// mean square over the result, to first order. Zero if all tangent points agree, infinite if a linearised
  /// covariance is singular.
  Scalar linearization_bound;
};

/// The angle on S^3 between the tangent points, in [0, pi/2]: half the angle of the rotation between them.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] Scalar tangent_angle(const BasicProjectedGaussian<Scalar, kProjection>& a,
                                   const BasicProjectedGaussian<Scalar, kProjection>& b) {
  using std::abs;
  using std::acos;
  return acos(std::min(Scalar(1), abs(a.tangent_point().dot(b.tangent_point()))));
}

namespace detail {

/// N(y; mean_1, S_1) N(y; mean_2, S_2) = exp(log_mass) N(y; mean, covariance).
template <class Scalar>
struct GaussianProduct {
  TangentGaussian<Scalar> density;
  Scalar log_mass;
  Scalar mahalanobis_squared;
};

/// A (L L^T)^-1.
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> right_divide(Matrix6<Scalar> A, const Matrix6<Scalar>& L) {
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) A.col(i) -= L(i, j) * A.col(j);
    A.col(i) /= L(i, i);
  }
  for (int i = 5; i >= 0; --i) {
    for (int j = i + 1; j < 6; ++j) A.col(i) -= L(j, i) * A.col(j);
    A.col(i) /= L(i, i);
  }
  return A;
}

/// The product of two Gaussians: the mean is mean_1 + K (mean_2 - mean_1) with K = S_1 (S_1 + S_2)^-1, the
/// covariance (S_1^-1 + S_2^-1)^-1 = (I - K) S_1 (I - K)^T + K S_2 K^T, which stays positive. The mean in MPG
/// Eq. (14) is right only if S_1 and S_2 commute.
template <class Scalar>
[[nodiscard]] GaussianProduct<Scalar> product(const TangentGaussian<Scalar>& y1,
                                              const TangentGaussian<Scalar>& y2) {
  const Matrix6<Scalar> sum = y1.covariance + y2.covariance;
  const std::optional<Matrix6<Scalar>> L = cholesky_factor(sum);
  if (!L) [[unlikely]] {
    throw_invalid("fusion of two densities that are both certain about the same, sum of covariances", sum);
  }
  const Vector6<Scalar> difference = y2.mean - y1.mean;
  const Matrix6<Scalar> K = right_divide(y1.covariance, *L);
  const Matrix6<Scalar> I_K = Matrix6<Scalar>::Identity() - K;
  const Matrix6<Scalar> S =
      congruence<Scalar, 6, 6>(I_K, y1.covariance) + congruence<Scalar, 6, 6>(K, y2.covariance);
  const Scalar d2 = solve_lower<Scalar, 6, 1>(*L, difference).squaredNorm();
  const Scalar log_mass = gaussian_log_peak(*L) - Scalar(0.5) * d2;
  return {{y1.mean + K * difference, symmetrized(S)}, log_mass, d2};
}

/// log C of the Gaussian's rotation.
template <class Scalar>
[[nodiscard]] Scalar log_hemisphere_mass(const TangentGaussian<Scalar>& y) {
  using std::log;
  const Matrix3<Scalar> uu = y.covariance.template topLeftCorner<3, 3>();
  return static_cast<Scalar>(log(hemisphere_mass<double>(y.mean.template head<3>().template cast<double>(),
                                                         uu.template cast<double>())));
}

/// E[(1 + |u|^2)^2] of the Gaussian's rotation.
template <class Scalar>
[[nodiscard]] Scalar mean_squared_stretch(const TangentGaussian<Scalar>& y) {
  const Matrix3<Scalar> S = y.covariance.template topLeftCorner<3, 3>();
  const Vector3<Scalar> m = y.mean.template head<3>();
  const Scalar r = S.trace() + m.squaredNorm();
  return Scalar(1) + Scalar(2) * r + r * r + Scalar(2) * S.squaredNorm() + Scalar(4) * m.dot(S * m);
}

/// sqrt(kappa), where u^T (Sigma^-1)_uu u <= kappa u^T (Sigma_uu)^-1 u. It is 1 if u and t are not
/// correlated.
template <class Scalar>
[[nodiscard]] Scalar coupling_factor(const Matrix6<Scalar>& L) {
  using std::sqrt;
  const Matrix3<Scalar> M =
      solve_lower<Scalar, 3, 3>(L.template bottomRightCorner<3, 3>(), L.template bottomLeftCorner<3, 3>());
  return sqrt(Scalar(1) + M.squaredNorm());
}

/// sqrt(kappa) sigma_rho, for the error of a linearised change of chart. To first order the log density is
/// off by -rho (u, 0)^T Sigma^-1 y, which is at most sqrt(kappa) sigma_rho D^3 at the Mahalanobis distance D
/// from the mean.
template <class Density, class Scalar>
[[nodiscard]] Scalar linearization_error(const Density& density, const ChartChange<Scalar>& f) {
  const Scalar sigma = f.nonlinearity(density.parameters());
  if (sigma == Scalar(0)) return sigma;
  return density.positive_definite() ? sigma * coupling_factor(density.sqrt_factor())
                                     : std::numeric_limits<Scalar>::infinity();
}

/// sqrt(E[D^6]) for D^2 = distance_squared + chi^2 with six degrees of freedom.
template <class Scalar>
[[nodiscard]] Scalar root_mean_sixth_power(Scalar distance_squared) {
  using std::sqrt;
  const Scalar d2 = distance_squared;
  return sqrt(((d2 + Scalar(18)) * d2 + Scalar(144)) * d2 + Scalar(480));
}

/// fuse() without the check that the tangent points are close enough.
template <class Scalar, Projection kProjection>
[[nodiscard]] Fusion<BasicProjectedGaussian<Scalar, kProjection>> fuse_anyway(
    const BasicProjectedGaussian<Scalar, kProjection>& a,
    const BasicProjectedGaussian<Scalar, kProjection>& b, Transport transport) {
  const Scalar sign = a.tangent_point().dot(b.tangent_point()) < Scalar(0) ? Scalar(-1) : Scalar(1);
  const Vector4<Scalar> q = (a.tangent_point() + sign * b.tangent_point()).normalized();
  const ChartChange<Scalar> from_a(a.tangent_point(), q), from_b(b.tangent_point(), q);
  const auto y_a = change_chart(transport, from_a, a.parameters(), a.sqrt_factor());
  const auto y_b = change_chart(transport, from_b, b.parameters(), b.sqrt_factor());
  const GaussianProduct<Scalar> y = product(y_a, y_b);

  Scalar log_mass = y.log_mass - std::numbers::ln2_v<Scalar>;
  if constexpr (kProjection == Projection::kRenormalized) {
    log_mass += log_hemisphere_mass(y.density) - log_hemisphere_mass(y_a) - log_hemisphere_mass(y_b);
  } else {
    using std::log;
    log_mass += log(mean_squared_stretch(y.density));
  }
  const Vector4<Scalar> mode = central_projection<Scalar>(q, y.density.mean.template head<3>());
  const auto at_mode = centered(y.density);
  BasicProjectedGaussian<Scalar, kProjection> fused(mode, at_mode.mean, at_mode.covariance);
  const Scalar rebasing = std::max(linearization_error(a, from_a), linearization_error(b, from_b));
  const Scalar centering = linearization_error(fused, ChartChange<Scalar>(mode, q));
  const Scalar bound =
      rebasing * root_mean_sixth_power(y.mahalanobis_squared) + centering * root_mean_sixth_power(Scalar(0));
  return {std::move(fused), log_mass, y.mahalanobis_squared, bound};
}

}  // namespace detail

/// The fusion of two independent estimates of one pose (MPG Eqs. 14-16): both restated at the rotation half
/// way between the tangent points, multiplied there, and centred at the mode.
///
/// On one tangent space, the product of two renormalised densities is exactly one of this kind, and log_mass
/// is exact. The product of two push-forwards has an extra factor (1 + |u|^2)^2, which log_mass includes and
/// the result leaves out. Commutative. Throws if the tangent points are more than max_angle apart.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] Fusion<BasicProjectedGaussian<Scalar, kProjection>> fuse(
    const BasicProjectedGaussian<Scalar, kProjection>& a,
    const BasicProjectedGaussian<Scalar, kProjection>& b, const FusionOptions<Scalar>& options = {}) {
  if (const Scalar angle = tangent_angle(a, b); !(angle <= options.max_angle)) [[unlikely]] {
    detail::throw_invalid("tangent points are too far apart to fuse, by [rad]", angle);
  }
  return detail::fuse_anyway(a, b, options.transport);
}

/// The density of a b, for independent poses: first b, then a (MPG Eq. 17: dq3 = dq2 dq1 with a = dq2,
/// b = dq1).
///
///     u' = (R_b^T u_a + u_b + (R_b^T u_a) x u_b) / (1 - (R_b^T u_a).u_b),   t' = t_a + R(q_a (1, u_a)) t_b
///
/// Linearised at the modes, the mean of t' is t_a + R_a t_b; "g(0, 0) = 0" in the paper holds for the
/// rotation only. The unscented transport includes that the spread of q_a shortens the mean of R(q_a) t_b.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] BasicProjectedGaussian<Scalar, kProjection> compose(
    const BasicProjectedGaussian<Scalar, kProjection>& a,
    const BasicProjectedGaussian<Scalar, kProjection>& b, Transport transport = Transport::kLinearized) {
  using Density = BasicProjectedGaussian<Scalar, kProjection>;
  if (!a.is_centered() || !b.is_centered()) return compose(a.centered(), b.centered(), transport);
  const Vector4<Scalar> q = hamilton_product(a.tangent_point(), b.tangent_point());
  const Matrix3<Scalar> R_a = rotation_matrix(a.tangent_point());
  const Matrix3<Scalar> R_bt = rotation_matrix(b.tangent_point()).transpose();
  const Vector3<Scalar> t_a = a.mean().template tail<3>(), t_b = b.mean().template tail<3>();
  if (transport == Transport::kUnscented) {
    using Vector12 = Vector<Scalar, 12>;
    Vector12 mean;
    mean << a.mean(), b.mean();
    Matrix<Scalar, 12> root = Matrix<Scalar, 12>::Zero();
    root.template topLeftCorner<6, 6>() = a.sqrt_factor();
    root.template bottomRightCorner<6, 6>() = b.sqrt_factor();
    const auto y = detail::unscented<12>(mean, root, [&](const Vector12& y_ab) {
      const auto x = a.project(y_ab.template head<6>()) * b.project(y_ab.template tail<6>());
      Vector6<Scalar> y_x;
      y_x << *detail::tangent_coordinates<Scalar>(q, x.rotation()), x.translation();
      return y_x;
    });
    return Density(q, y.mean, y.covariance).centered();
  }
  // J = [R_b^T, 0, I, 0; -2 R_a [t_b]x, I, 0, R_a], for the columns u_a, t_a, u_b, t_b.
  Matrix6<Scalar> J_a = Matrix6<Scalar>::Identity(), J_b = Matrix6<Scalar>::Identity();
  J_a.template topLeftCorner<3, 3>() = R_bt;
  J_a.template bottomLeftCorner<3, 3>() = Scalar(-2) * R_a * skew(t_b);
  J_b.template bottomRightCorner<3, 3>() = R_a;
  const Matrix6<Scalar> S = detail::congruence<Scalar, 6, 6>(J_a, a.covariance()) +
                            detail::congruence<Scalar, 6, 6>(J_b, b.covariance());
  return {q.normalized(), detail::centered_mean<Scalar>(t_a + R_a * t_b), detail::symmetrized(S)};
}

/// The density of y x for a known pose y: a change of the parent frame. Exact.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] BasicProjectedGaussian<Scalar, kProjection> compose(
    const DualQuaternion<Scalar>& y, const BasicProjectedGaussian<Scalar, kProjection>& x) {
  Matrix6<Scalar> J = Matrix6<Scalar>::Identity();
  J.template bottomRightCorner<3, 3>() = y.rotation_matrix();
  Vector6<Scalar> mean = x.mean();
  mean.template tail<3>() = y * x.mean().template tail<3>();
  return {hamilton_product(y.rotation(), x.tangent_point()), mean,
          detail::symmetrized(detail::congruence<Scalar, 6, 6>(J, x.covariance()))};
}

/// The density of x y for a known pose y: a change of the child frame. Linearised if y has a translation.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] BasicProjectedGaussian<Scalar, kProjection> compose(
    const BasicProjectedGaussian<Scalar, kProjection>& x, const DualQuaternion<Scalar>& y,
    Transport transport = Transport::kLinearized) {
  return compose(x, BasicProjectedGaussian<Scalar, kProjection>(y, Matrix6<Scalar>::Zero()), transport);
}

/// The density of x^-1: u' = -R(q0) u, t' = -R(q)^T t.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] BasicProjectedGaussian<Scalar, kProjection> inverse(
    const BasicProjectedGaussian<Scalar, kProjection>& x, Transport transport = Transport::kLinearized) {
  using Density = BasicProjectedGaussian<Scalar, kProjection>;
  if (!x.is_centered()) return inverse(x.centered(), transport);
  const Vector4<Scalar> q = conjugate(x.tangent_point());
  if (transport == Transport::kUnscented) {
    const auto y = detail::unscented<6>(x.mean(), x.sqrt_factor(), [&](const Vector6<Scalar>& y_x) {
      const auto inverted = x.project(y_x).inverse();
      Vector6<Scalar> y_inverse;
      y_inverse << *detail::tangent_coordinates<Scalar>(q, inverted.rotation()), inverted.translation();
      return y_inverse;
    });
    return Density(q, y.mean, y.covariance).centered();
  }
  const Matrix3<Scalar> R = rotation_matrix(x.tangent_point());
  const Vector3<Scalar> t = -(R.transpose() * x.mean().template tail<3>());
  Matrix6<Scalar> J = Matrix6<Scalar>::Zero();
  J.template topLeftCorner<3, 3>() = -R;
  J.template bottomLeftCorner<3, 3>() = Scalar(2) * skew(t);
  J.template bottomRightCorner<3, 3>() = -R.transpose();
  return {q, detail::centered_mean<Scalar>(t),
          detail::symmetrized(detail::congruence<Scalar, 6, 6>(J, x.covariance()))};
}

/// The density of a^-1 b for independent poses: b as seen from a.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] BasicProjectedGaussian<Scalar, kProjection> relative_pose(
    const BasicProjectedGaussian<Scalar, kProjection>& a,
    const BasicProjectedGaussian<Scalar, kProjection>& b, Transport transport = Transport::kLinearized) {
  return compose(inverse(a, transport), b, transport);
}

}  // namespace antipode
