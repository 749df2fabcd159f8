// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/standard_normal.hpp>
#include <antipode/distributions/detail/hemisphere_mass.hpp>
#include <antipode/distributions/detail/off_center_rejection.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// Gaussians on a tangent space, projected to densities of poses (MPG).
namespace antipode {

/// The two densities of poses that a Gaussian on a tangent space can stand for. They agree where the rotation
/// is concentrated.
enum class Projection {
  kRenormalized,  ///< the Gaussian's values, renormalised on the sphere: products are again of this kind
  kPushForward,   ///< the density of projected Gaussian draws: moments and likelihoods are those of the
                  ///< Gaussian
};

/// A density of poses: a Gaussian on the tangent space of a rotation q0 and R^3, projected to SE(3).
///
///     y = (u, t) ~ N(mu, Sigma),   q = q0 (1, u) / sqrt(1 + |u|^2)
///
/// The coordinates u are half a rotation vector in the child's frame to second order; t is the translation in
/// the parent's frame [m]. q and -q have the same coordinates. The densities are with respect to the surface
/// measure of the whole S^3 times volume, as those of BinghamGaussian:
///
///     kRenormalized (MPG Eqs. 11-12)   p(q, t) = N(y; mu, Sigma) / (2 C),   C = E[(1 + |u|^2)^-2]
///     kPushForward                     p(q, t) = N(y; mu, Sigma) (1 + |u|^2)^2 / 2
///
/// The paper defines the former, but samples from and fits the latter. With mu_u = 0 the tangent point is the
/// mode: MPG's PG0. A rotation a half-turn away from q0 has density 0. Sigma may be singular: everything
/// works but log_density. Reference: W. Feiten and M. Lang, "MPG - A Framework for Reasoning on 6 DOF Pose
/// Uncertainty", 2017, sec. III.
template <std::floating_point Scalar_, Projection kProjection_>
class BasicProjectedGaussian {
 public:
  using Scalar = Scalar_;                                  ///< of coordinates and densities
  using Pose = DualQuaternion<Scalar>;                     ///< what it is a density of
  static constexpr Projection kProjection = kProjection_;  ///< which of the two densities
  /// Largest tr Sigma_uu + |mu_u|^2. A value of 0.25 is a standard deviation of 33 degrees about each axis.
  static constexpr Scalar kMaxSpread = Scalar(1e8);

  /// N(q0, mu, Sigma) (MPG Eq. 13). Throws unless q0 is unit within kUnitTolerance, all is finite, Sigma is
  /// symmetric and positive semidefinite, and the spread of u is at most kMaxSpread.
  BasicProjectedGaussian(const Vector4<Scalar>& tangent_point, const Vector6<Scalar>& mean,
                         const Matrix6<Scalar>& covariance)
      : tangent_point_(normalized_quaternion(tangent_point)),
        mean_(mean),
        covariance_(
            detail::checked_covariance("tangent covariance is not finite or not symmetric", covariance)),
        root_(detail::root_of_covariance("tangent covariance has a negative eigenvalue", covariance_)) {
    using std::log;
    detail::require_finite("tangent mean is not finite", mean);
    const Scalar spread =
        covariance_.template topLeftCorner<3, 3>().trace() + mean_.template head<3>().squaredNorm();
    if (!(spread <= kMaxSpread)) [[unlikely]] {
      detail::throw_invalid("tangent coordinates of the rotation spread too widely, by", spread);
    }
    log_normalizer_ = std::numbers::ln2_v<Scalar>;
    if constexpr (kProjection == Projection::kRenormalized) {
      log_normalizer_ += static_cast<Scalar>(log(hemisphere_mass()));
    }
    if (root_.positive_definite) {
      log_peak_ = detail::gaussian_log_peak(root_.L) - log_normalizer_;
    }
  }

  /// PG0: the tangent point is the mode, and the covariance is that of (u, t) at the mode. Throws as above.
  BasicProjectedGaussian(const Pose& mode, const Matrix6<Scalar>& covariance)
      : BasicProjectedGaussian(mode.rotation(), detail::centered_mean<Scalar>(mode.translation()),
                               covariance) {}

  /// The same parameters (q0, mu, Sigma) with the other projection: another density (match_push_forward and
  /// match_renormalized keep the moments).
  explicit BasicProjectedGaussian(
      const BasicProjectedGaussian<Scalar, kProjection == Projection::kRenormalized
                                               ? Projection::kPushForward
                                               : Projection::kRenormalized>& other)
      : BasicProjectedGaussian(other.tangent_point(), other.mean(), other.covariance()) {}

  /// q0; -q0 is the same tangent space.
  [[nodiscard]] const Vector4<Scalar>& tangent_point() const noexcept { return tangent_point_; }
  /// mu = (mu_u, mu_t).
  [[nodiscard]] const Vector6<Scalar>& mean() const noexcept { return mean_; }
  /// Sigma, of (u, t): 1, m, m^2. Four times the block of u is that of the rotation vector [rad^2].
  [[nodiscard]] const Matrix6<Scalar>& covariance() const noexcept { return covariance_; }
  /// L with L L^T = Sigma, lower triangular unless Sigma is singular.
  [[nodiscard]] const Matrix6<Scalar>& sqrt_factor() const noexcept { return root_.L; }
  /// Whether Sigma is regular, so that there is a density.
  [[nodiscard]] bool positive_definite() const noexcept { return root_.positive_definite; }
  /// log N(mu; mu, Sigma), if Sigma is regular.
  [[nodiscard]] Scalar gaussian_log_peak() const noexcept { return log_peak_ + log_normalizer_; }

  /// Pi(mu): the mode of the renormalised density, and of the push-forward one where it is concentrated.
  [[nodiscard]] Pose pose() const { return project(mean_); }
  /// Whether the tangent point is the mode (PG0).
  [[nodiscard]] bool is_centered() const { return mean_.template head<3>().isZero(Scalar(0)); }
  /// C, the mass of the Gaussian's values on a hemisphere, in (0, 1] (MPG Eq. 12 is 2 C). Below 0.5 the
  /// rotation is not concentrated, and linearised results are inaccurate.
  [[nodiscard]] double hemisphere_mass() const {
    const Matrix3<Scalar> uu = covariance_.template topLeftCorner<3, 3>();
    return detail::hemisphere_mass<double>(mean_.template head<3>().template cast<double>(),
                                           uu.template cast<double>());
  }
  /// log of the divisor of the Gaussian: log 2 C, and log 2 for the push-forward.
  [[nodiscard]] Scalar log_normalizer() const noexcept { return log_normalizer_; }

  /// The pose at tangent coordinates y = (u, t) (MPG Eqs. 8-10).
  [[nodiscard]] Pose project(const Vector6<Scalar>& y) const {
    return Pose::from_rotation_translation(
        detail::central_projection<Scalar>(tangent_point_, y.template head<3>()), y.template tail<3>());
  }
  /// The tangent coordinates y = (u, t) of a pose. Throws where the rotation is a half-turn away from q0.
  [[nodiscard]] Vector6<Scalar> coordinates(const Pose& pose) const {
    const auto u = detail::tangent_coordinates(tangent_point_, pose.rotation());
    if (!u) [[unlikely]] {
      detail::throw_invalid("rotation is a half-turn away from the tangent point", pose.rotation());
    }
    Vector6<Scalar> y;
    y << *u, pose.translation();
    return y;
  }

  /// log p(q, t); -infinity where the rotation is a half-turn away, NaN at a pose that is NaN. Throws
  /// std::domain_error if Sigma is singular.
  [[nodiscard]] Scalar log_density(const Pose& pose) const {
    using std::log1p;
    if (!root_.positive_definite) [[unlikely]] {
      throw std::domain_error("a projected Gaussian with a singular covariance has no density");
    }
    const auto u = detail::tangent_coordinates(tangent_point_, pose.rotation());
    using Limits = std::numeric_limits<Scalar>;
    if (!u) return pose.rotation().hasNaN() ? Limits::quiet_NaN() : -Limits::infinity();
    Vector6<Scalar> y;
    y << *u, pose.translation();
    const Vector6<Scalar> whitened = detail::solve_lower<Scalar, 6, 1>(root_.L, y - mean_);
    const Scalar value = log_peak_ - Scalar(0.5) * whitened.squaredNorm();
    return kProjection == Projection::kRenormalized ? value : value + Scalar(2) * log1p(u->squaredNorm());
  }

  /// The density in the tangent space of another rotation (MPG Eqs. 15-16). Throws if the mean, or a sigma
  /// point, would lie at the edge of the new tangent space.
  [[nodiscard]] BasicProjectedGaussian rebased(const Vector4<Scalar>& tangent_point,
                                               Transport transport = Transport::kLinearized) const {
    const Vector4<Scalar> q = normalized_quaternion(tangent_point);
    const auto y = detail::change_chart(transport, {tangent_point_, q}, parameters(), root_.L);
    return {q, y.mean, y.covariance};
  }

  /// The density with the tangent point at its mode (PG0), linearised.
  [[nodiscard]] BasicProjectedGaussian centered() const {
    if (is_centered()) return *this;
    const auto y = detail::centered(parameters());
    return {detail::central_projection<Scalar>(tangent_point_, mean_.template head<3>()), y.mean,
            y.covariance};
  }

  /// An exact draw. Renormalised densities are drawn by rejection: from the Gaussian, where hemisphere_mass()
  /// is the probability of acceptance; uniformly from the sphere, where that accepts more; from both, where
  /// the mean is far from the tangent point.
  template <std::uniform_random_bit_generator Rng>
  [[nodiscard]] Pose sample(Rng& rng) const {
    if constexpr (kProjection == Projection::kPushForward) {
      return project(mean_ + root_.L * detail::standard_normal<Scalar, 6>(rng));
    } else {
      using std::exp;
      const Matrix3<Scalar> L_u = root_.L.template topLeftCorner<3, 3>();
      const Vector3<Scalar> mean_u = mean_.template head<3>();
      if (mean_u.squaredNorm() > Scalar(1)) return sample_off_center(rng);
      const bool nearly_uniform = root_.positive_definite && L_u.diagonal().prod() > kUniformSpread;
      std::uniform_real_distribution<Scalar> uniform;
      for (;;) {
        Vector6<Scalar> z = detail::standard_normal<Scalar, 6>(rng);
        if (nearly_uniform) {
          const Vector4<Scalar> q = detail::standard_normal<Scalar, 4>(rng);
          const Vector3<Scalar> u = q.template tail<3>() / q[0];
          z.template head<3>() = detail::solve_lower<Scalar, 3, 1>(L_u, u - mean_u);
          if (uniform(rng) < exp(Scalar(-0.5) * z.template head<3>().squaredNorm()))
            return project(mean_ + root_.L * z);
        } else {
          const Vector6<Scalar> y = mean_ + root_.L * z;
          const Scalar stretch = Scalar(1) + y.template head<3>().squaredNorm();
          if (uniform(rng) * stretch * stretch < Scalar(1)) return project(y);
        }
      }
    }
  }

  /// mean() and covariance() in one.
  [[nodiscard]] detail::TangentGaussian<Scalar> parameters() const { return {mean_, covariance_}; }

 private:
  /// A draw where the mean is far from the tangent point.
  template <class Rng>
  [[nodiscard]] Pose sample_off_center(Rng& rng) const {
    using std::log;
    using std::log1p;
    using std::sqrt;
    const Vector3<Scalar> mean_u = mean_.template head<3>();
    if (root_.positive_definite) {
      Vector6<Scalar> z = detail::standard_normal<Scalar, 6>(rng);
      const Matrix3<Scalar> L_u = root_.L.template topLeftCorner<3, 3>();
      z.template head<3>() = detail::OffCenterRejection<Scalar>(mean_u, L_u).draw(rng);
      return project(mean_ + root_.L * z);
    }
    // A singular Gaussian has no density to bound. Up to a negligible probability, it stays beyond this
    // radius.
    const Scalar norm = mean_u.norm();
    const Vector6<Scalar> along_mean = root_.L.template topRows<3>().transpose() * (mean_u / norm);
    const Scalar reach = sqrt(Scalar(80) + Scalar(8) * log(norm)) * along_mean.norm();
    const Scalar radius = std::max(Scalar(0), norm - reach);
    std::uniform_real_distribution<Scalar> uniform;
    for (;;) {
      const Vector6<Scalar> y = mean_ + root_.L * detail::standard_normal<Scalar, 6>(rng);
      const Scalar stretch = log1p(y.template head<3>().squaredNorm()) - log1p(radius * radius);
      if (log(uniform(rng)) < Scalar(-2) * stretch) return project(y);
    }
  }

  /// sqrt(det Sigma_uu) from which on the Gaussian's peak is below that of the uniform density, pi^-2.
  static constexpr Scalar kUniformSpread = Scalar(0.62666);  // pi^2 (2 pi)^(-3/2)

  Vector4<Scalar> tangent_point_;
  Vector6<Scalar> mean_;
  Matrix6<Scalar> covariance_;
  detail::RootOfCovariance<Scalar, 6> root_;
  Scalar log_normalizer_;
  Scalar log_peak_ = 0;  // log density at the mean, if Sigma is regular
};

/// The paper's density, MPG Eqs. (11)-(12): the kind to fuse.
template <class Scalar>
using ProjectedGaussian = BasicProjectedGaussian<Scalar, Projection::kRenormalized>;
/// The density of projected Gaussian draws: the kind to fit and to transform.
template <class Scalar>
using PushForwardGaussian = BasicProjectedGaussian<Scalar, Projection::kPushForward>;

}  // namespace antipode
