// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <random>

#include <antipode/detail/check.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/bingham.hpp>
#include <antipode/distributions/gaussian.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// A density of poses that is valid for wide orientations, too.
namespace antipode {
namespace detail {

/// tau(q) = (m.q) (M_1.q, M_2.q, M_3.q).
template <class Scalar>
[[nodiscard]] Vector3<Scalar> orientation_offset(const Bingham<Scalar, 4>& orientation,
                                                 const Vector4<Scalar>& q) {
  const Vector4<Scalar> x = orientation.axes().transpose() * q;
  return x[3] * x.template head<3>();
}

/// B: rotations about the column B_i of the child's frame move the mode along the axis M_i.
template <class Scalar>
[[nodiscard]] Matrix3<Scalar> tangent_axes(const Bingham<Scalar, 4>& orientation) {
  return (left_matrix(orientation.mode()).transpose() * orientation.axes()).template block<3, 3>(1, 0);
}

}  // namespace detail

/// A density of poses: Bingham orientation, Gaussian translation given the orientation.
///
///     q ~ Bingham(M, z),   t | q ~ N(mu + G tau(q), Sc),   tau_i(q) = (M_4.q)(M_i.q),  i = 1, 2, 3
///
/// For small rotations tau is half the rotation vector from the mode M_4 to q, in the basis M_1, M_2, M_3. It
/// is quadratic in q, so that q and -q have the same density, and its moments are those of the Bingham
/// density: E[tau] = 0 and Cov(tau) = diag(E[x_4^2 x_i^2]) = T. Hence E[t] = mu, Cov(t) = Sc + G T G^T and
/// Cov(t, tau) = G T. The translation t, mu and the columns of G are in the parent frame [m]; Sc is in m^2.
/// The coupling G = 0 is the independent model of DQV-SLAM sec. III-B. The density is with respect to the
/// surface measure of the whole S^3 times volume; the marginal of q is the Bingham density.
template <std::floating_point Scalar_>
class BinghamGaussian {
 public:
  using Scalar = Scalar_;                        ///< of coordinates and densities
  using Orientation = Bingham<Scalar, 4>;        ///< the marginal density of q
  using Pose = DualQuaternion<Scalar>;           ///< what it is a density of
  using FitOptions = BinghamFitOptions<Scalar>;  ///< of the orientation

  /// Throws unless the mean, the coupling G and the conditional covariance Sc are finite and Sc is symmetric
  /// and positive semidefinite.
  BinghamGaussian(const Orientation& orientation, const Vector3<Scalar>& mean_translation,
                  const Matrix3<Scalar>& coupling, const Matrix3<Scalar>& conditional_covariance)
      : orientation_(orientation),
        mean_translation_(mean_translation),
        coupling_(coupling),
        residual_(Vector3<Scalar>::Zero(), conditional_covariance) {
    detail::require_finite("mean translation is not finite", mean_translation);
    detail::require_finite("coupling of orientation and translation is not finite", coupling);
  }

  /// Orientation and translation independent, G = 0.
  [[nodiscard]] static BinghamGaussian independent(const Orientation& orientation,
                                                   const Vector3<Scalar>& mean_translation,
                                                   const Matrix3<Scalar>& covariance) {
    return {orientation, mean_translation, Matrix3<Scalar>::Zero(), covariance};
  }

  /// The density whose pose() and covariance() are the given ones. P is the 6x6 covariance of xi = (phi, rho)
  /// [rad, m] in x exp(xi). Second moments of the orientation below min_eigenvalue are raised to it; the
  /// default of 1e-14 is 2e-7 rad. Throws unless P is symmetric and positive semidefinite, and its rotation
  /// part narrow enough for the pose to be the mode (see Bingham::from_mode_covariance).
  [[nodiscard]] static BinghamGaussian from_pose_covariance(const Pose& pose, const Matrix6<Scalar>& P,
                                                            const FitOptions& options = {
                                                                .min_eigenvalue = Scalar(1e-14)}) {
    const Matrix6<Scalar> covariance =
        detail::checked_covariance("pose covariance is not finite or not symmetric", P);
    (void)detail::root_of_covariance("pose covariance has a negative eigenvalue", covariance);
    const Orientation orientation = Orientation::from_mode_covariance(
        pose.rotation(), covariance.template topLeftCorner<3, 3>(), options);
    const Matrix3<Scalar> R = pose.rotation_matrix();
    const Matrix3<Scalar> rho_phi = covariance.template bottomLeftCorner<3, 3>();
    const Matrix3<Scalar> rho_rho = covariance.template bottomRightCorner<3, 3>();
    const Vector3<Scalar> omega = orientation.second_moments().template head<3>();
    const Matrix3<Scalar> R_rho_phi = R * rho_phi;
    Matrix3<Scalar> G = R_rho_phi * detail::tangent_axes(orientation);
    for (int i = 0; i < 3; ++i) G.col(i) *= Scalar(0.5) / omega[i];
    const Matrix3<Scalar> Sc =
        detail::congruence<Scalar, 3, 3>(R, rho_rho) - detail::scaled_square<Scalar, 3, 3>(G, omega);
    return {orientation, pose.translation(), G, detail::without_negative_eigenvalues(Sc)};
  }

  /// The marginal density of q.
  [[nodiscard]] const Orientation& orientation() const noexcept { return orientation_; }
  /// mu = E[t].
  [[nodiscard]] const Vector3<Scalar>& mean_translation() const noexcept { return mean_translation_; }
  /// G. If the sign of the axis M_i flips, so does that of column i; if that of M_4 flips, so do all columns.
  [[nodiscard]] const Matrix3<Scalar>& coupling() const noexcept { return coupling_; }
  /// Sc = Cov(t | q).
  [[nodiscard]] const Matrix3<Scalar>& conditional_covariance() const noexcept {
    return residual_.covariance();
  }
  /// L with L L^T = Sc.
  [[nodiscard]] const Matrix3<Scalar>& conditional_sqrt_factor() const noexcept {
    return residual_.sqrt_factor();
  }

  /// tau(q); tau(-q) is the same.
  [[nodiscard]] Vector3<Scalar> orientation_offset(const Vector4<Scalar>& q) const {
    return detail::orientation_offset(orientation_, q);
  }
  /// E[t | q] = mu + G tau(q).
  [[nodiscard]] Vector3<Scalar> conditional_mean(const Vector4<Scalar>& q) const {
    return mean_translation_ + coupling_ * orientation_offset(q);
  }

  /// The diagonal of T = Cov(tau); its other entries are zero.
  [[nodiscard]] Vector3<Scalar> orientation_offset_variances() const {
    return orientation_.fourth_moments().template topRightCorner<3, 1>();
  }
  /// Cov(t) = Sc + G T G^T.
  [[nodiscard]] Matrix3<Scalar> translation_covariance() const {
    return conditional_covariance() +
           detail::scaled_square<Scalar, 3, 3>(coupling_, orientation_offset_variances());
  }

  /// The mode of the orientation with the mean translation.
  [[nodiscard]] Pose pose() const {
    return Pose::from_rotation_translation(orientation_.mode(), mean_translation_);
  }

  /// The covariance of xi = (phi, rho), rotation first, in pose() exp(xi). Linearised at the mode, where
  /// phi = 2 B tau, Cov(tau) = diag(omega_1, omega_2, omega_3) and rho = R^T (t - mu): for a concentrated
  /// orientation, with a relative error of order omega_3.
  [[nodiscard]] Matrix6<Scalar> covariance() const {
    // (phi, rho) = J tau + (0, R^T residual).
    const Vector3<Scalar> omega = orientation_.second_moments().template head<3>();
    const Matrix3<Scalar> R_inverse = rotation_matrix(orientation_.mode()).transpose();
    Matrix<Scalar, 6, 3> J;
    J.template topRows<3>() = Scalar(2) * detail::tangent_axes(orientation_);
    J.template bottomRows<3>() = R_inverse * coupling_;
    Matrix6<Scalar> P = detail::scaled_square<Scalar, 6, 3>(J, omega);
    P.template bottomRightCorner<3, 3>() +=
        detail::congruence<Scalar, 3, 3>(R_inverse, conditional_covariance());
    return P;
  }

  /// log f(q, t). Throws std::domain_error if the conditional covariance is singular.
  [[nodiscard]] Scalar log_density(const Pose& pose) const {
    return orientation_.log_density(pose.rotation()) +
           residual_.log_density(pose.translation() - conditional_mean(pose.rotation()));
  }

  /// An exact draw; the sign of its rotation is random.
  template <std::uniform_random_bit_generator Rng>
  [[nodiscard]] Pose sample(Rng& rng) const {
    const Vector4<Scalar> q = orientation_.sample(rng);
    return Pose::from_rotation_translation(q, conditional_mean(q) + residual_.sample(rng));
  }

 private:
  Orientation orientation_;
  Vector3<Scalar> mean_translation_;
  Matrix3<Scalar> coupling_;
  Gaussian<Scalar, 3> residual_;  // t - E[t | q]
};

/// What moment_match keeps of the samples.
template <std::floating_point Scalar>
struct MomentMatchOptions {
  /// Whether to keep the correlation of orientation and translation; without it the result is independent.
  bool keep_coupling = true;
  /// See BinghamFitOptions.
  Scalar min_eigenvalue = BinghamFitOptions<Scalar>{}.min_eigenvalue;
};

namespace detail {

/// References to columns [q; p] and weights of any number, so that the code below is compiled once per scalar
/// type.
template <class Scalar>
using PoseColumns = Eigen::Ref<const Matrix<Scalar, 8, Eigen::Dynamic>>;
template <class Scalar>
using Weights = Eigen::Ref<const Vector<Scalar, Eigen::Dynamic>>;

/// The sum of the weights. Throws unless all are non-negative and finite, with a positive sum.
template <class Scalar>
[[nodiscard]] Scalar checked_sum(const Weights<Scalar>& weights) {
  const Scalar sum = weights.sum();
  if (!std::isfinite(sum) || !(sum > Scalar(0)) || !(weights.minCoeff() >= Scalar(0))) [[unlikely]] {
    throw_invalid("weights are not finite and non-negative with a positive sum", weights);
  }
  return sum;
}

template <class Scalar>
[[nodiscard]] BinghamGaussian<Scalar> match_moments(const PoseColumns<Scalar>& points,
                                                    const Weights<Scalar>& weights,
                                                    const MomentMatchOptions<Scalar>& options) {
  if (points.cols() != weights.size()) [[unlikely]] {
    throw_invalid("there must be one weight per sample; number of weights", weights.size());
  }
  const Scalar sum = checked_sum<Scalar>(weights);
  const auto for_each_sample = [&](const auto& visit) {
    for (Eigen::Index k = 0; k < weights.size(); ++k) {
      const auto pose = DualQuaternion<Scalar>::unchecked(points.col(k));
      visit(weights[k] / sum, pose.rotation(), pose.translation());
    }
  };
  using Rotation = Vector4<Scalar>;
  using Translation = Vector3<Scalar>;

  Matrix4<Scalar> scatter = Matrix4<Scalar>::Zero();
  Vector3<Scalar> mean = Vector3<Scalar>::Zero();
  for_each_sample([&](Scalar weight, const Rotation& q, const Translation& t) {
    add_outer_product(weight, q, q, scatter);
    mean += weight * t;
  });
  const auto orientation = Bingham<Scalar, 4>::fit(scatter, {.min_eigenvalue = options.min_eigenvalue});

  // G is the least-squares fit of t on tau. The sample mean of tau is zero: it is the off-diagonal part of
  // the scatter matrix, which is diagonal in the axes of the fit.
  Matrix3<Scalar> coupling = Matrix3<Scalar>::Zero();
  if (options.keep_coupling) {
    Matrix3<Scalar> t_tau = Matrix3<Scalar>::Zero();
    Matrix3<Scalar> tau_tau = Matrix3<Scalar>::Zero();
    for_each_sample([&](Scalar weight, const Rotation& q, const Translation& t) {
      const Vector3<Scalar> tau = orientation_offset(orientation, q);
      add_outer_product<Scalar, 3, 3>(weight, t - mean, tau, t_tau);
      add_outer_product(weight, tau, tau, tau_tau);
    });
    coupling = t_tau * pseudo_inverse(tau_tau);
  }

  Matrix3<Scalar> residual_covariance = Matrix3<Scalar>::Zero();
  for_each_sample([&](Scalar weight, const Rotation& q, const Translation& t) {
    const Vector3<Scalar> residual = t - mean - coupling * orientation_offset(orientation, q);
    add_outer_product(weight, residual, residual, residual_covariance);
  });
  return {orientation, mean, coupling, residual_covariance};
}

}  // namespace detail

/// The density with the moments of weighted poses (the columns [q; p]; the weights need not be normalised).
///
/// The scatter matrix of q, E[t], Cov(t) and, if the coupling is kept, Cov(t, tau) are those of the samples
/// (DQV-SLAM Alg. 2 line 12, with the weights normalised). The signs of the poses do not matter. Throws on
/// weights that are negative or sum to zero, on anything not finite, and unless there is one weight per pose.
template <class Points, class Weights>
requires(Points::RowsAtCompileTime == 8) [[nodiscard]] BinghamGaussian<typename Points::Scalar> moment_match(
    const Eigen::MatrixBase<Points>& points, const Eigen::MatrixBase<Weights>& weights,
    const MomentMatchOptions<typename Points::Scalar>& options = {}) {
  return detail::match_moments<typename Points::Scalar>(points, weights, options);
}

/// The density with the moments of weighted samples, such as those of a sigma point rule.
template <std::floating_point Scalar, int Count>
[[nodiscard]] BinghamGaussian<Scalar> moment_match(const WeightedSamples<Scalar, 8, Count>& samples,
                                                   const MomentMatchOptions<Scalar>& options = {}) {
  return detail::match_moments<Scalar>(samples.points, samples.weights, options);
}

/// The density of y x for a constant pose y: a change of the parent frame. Exact.
template <std::floating_point Scalar>
[[nodiscard]] BinghamGaussian<Scalar> compose(const DualQuaternion<Scalar>& y,
                                              const BinghamGaussian<Scalar>& x) {
  const Matrix3<Scalar> R = y.rotation_matrix();
  return {compose(y.rotation(), x.orientation()), y * x.mean_translation(), R * x.coupling(),
          detail::congruence<Scalar, 3, 3>(R, x.conditional_covariance())};
}

/// The density with the moments of x y for a constant pose y: a change of the child frame.
///
/// The orientation q q_y is exact. The translation t + R(q) t_y is quadratic in the coordinates x_a = M_a.q,
///
///     R(q) t_y = sum_a x_a^2 c_aa + sum_(a<b) x_a x_b d_ab
///     c_ab = vec(M_a t_y M_b*),   d_ab = c_ab + c_ba
///
/// The terms with x_4 x_i = tau_i are added to the coupling. E[t], Cov(t) and Cov(t, tau) are exact, by the
/// fourth moments of the Bingham density.
template <std::floating_point Scalar>
[[nodiscard]] BinghamGaussian<Scalar> compose(const BinghamGaussian<Scalar>& x,
                                              const DualQuaternion<Scalar>& y) {
  const Matrix4<Scalar>& M = x.orientation().axes();
  Vector4<Scalar> t_y = Vector4<Scalar>::Zero();
  t_y.template tail<3>() = y.translation();
  const auto c = [&](int a, int b) -> Vector3<Scalar> {
    return hamilton_product(hamilton_product(M.col(a), t_y), conjugate(M.col(b))).template tail<3>();
  };
  const Vector4<Scalar>& omega = x.orientation().second_moments();
  const Matrix4<Scalar> fourth = x.orientation().fourth_moments();
  Matrix<Scalar, 3, 4> squares;
  Matrix3<Scalar> coupling = x.coupling();
  Matrix3<Scalar> residual_covariance = x.conditional_covariance();
  for (int a = 0; a < 4; ++a) squares.col(a) = c(a, a);
  for (int i = 0; i < 3; ++i) {
    coupling.col(i) += c(i, 3) + c(3, i);
    for (int j = i + 1; j < 3; ++j) {
      const Vector3<Scalar> d = c(i, j) + c(j, i);
      detail::add_outer_product(fourth(i, j), d, d, residual_covariance);
    }
  }
  residual_covariance += detail::congruence<Scalar, 3, 4>(squares, fourth - omega * omega.transpose());
  return {compose(x.orientation(), y.rotation()), x.mean_translation() + squares * omega, coupling,
          residual_covariance};
}

/// The PoseGaussian with the pose() and the covariance() of the density. Right to first order in the
/// rotation's covariance.
template <std::floating_point Scalar>
[[nodiscard]] PoseGaussian<Scalar> to_pose_gaussian(const BinghamGaussian<Scalar>& density) {
  return {density.pose(), density.covariance()};
}

/// The inverse of to_pose_gaussian(), see BinghamGaussian::from_pose_covariance().
///
/// Second moments of the orientation below min_eigenvalue are raised to it; the default of 1e-14 is 2e-7 rad.
/// Throws unless the covariance is symmetric and positive semidefinite, and narrow enough for the pose to be
/// the mode.
template <std::floating_point Scalar>
[[nodiscard]] BinghamGaussian<Scalar> to_bingham_gaussian(const PoseGaussian<Scalar>& density,
                                                          const BinghamFitOptions<Scalar>& options = {
                                                              .min_eigenvalue = Scalar(1e-14)}) {
  return BinghamGaussian<Scalar>::from_pose_covariance(density.pose, density.covariance, options);
}

}  // namespace antipode
