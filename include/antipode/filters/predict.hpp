// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <string_view>
#include <type_traits>
#include <utility>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_algebra.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/jacobians.hpp>
#include <antipode/geometry/quaternion.hpp>
#include <antipode/sampling/pose_rules.hpp>
#include <antipode/sampling/sigma_point_rule.hpp>

/// @file
/// Prediction of a pose by a measured motion, x_k = x_(k-1) u_k v_k (DQV-SLAM Eqs. 5-7, 11).
///
/// x maps the moving frame to the fixed one; u_k, the measured motion, maps the moving frame at k to that at
/// k-1; v_k is its noise, independent of the state, with a mean near the identity.
namespace antipode {

namespace detail {

/// The moments that make up a BinghamGaussian, added one pose at a time when the orientation's density is
/// known beforehand: those of tau (see BinghamGaussian) and of the translation, relative to a reference near
/// the mean.
template <class Scalar>
class PoseMoments {
 public:
  PoseMoments(const Bingham<Scalar, 4>& orientation, const Vector3<Scalar>& reference)
      : orientation_(orientation), reference_(reference) {}

  /// A pose with the coordinates x = M^T q of its rotation in the axes of the orientation.
  void add(Scalar weight, const Vector4<Scalar>& x, const Vector3<Scalar>& translation) noexcept {
    Vector6<Scalar> y;
    y << x[3] * x.template head<3>(), translation - reference_;
    const Vector6<Scalar> weighted = weight * y;
    mean_ += weighted;
    second_ += weighted * y.transpose();
  }

  [[nodiscard]] BinghamGaussian<Scalar> density(bool keep_coupling) const {
    const Matrix6<Scalar> covariance = second_ - mean_ * mean_.transpose();
    const Matrix3<Scalar> t_tau = covariance.template bottomLeftCorner<3, 3>();
    const Matrix3<Scalar> coupling =
        keep_coupling ? (t_tau * pseudo_inverse<Scalar>(covariance.template topLeftCorner<3, 3>())).eval()
                      : Matrix3<Scalar>::Zero();
    const Matrix3<Scalar> residual =
        covariance.template bottomRightCorner<3, 3>() - coupling * t_tau.transpose();
    return {orientation_, reference_ + mean_.template tail<3>(), coupling,
            without_negative_eigenvalues<Scalar, 3>(Scalar(0.5) * (residual + residual.transpose()))};
  }

 private:
  const Bingham<Scalar, 4>& orientation_;
  Vector3<Scalar> reference_;
  Vector6<Scalar> mean_ = Vector6<Scalar>::Zero();
  Matrix6<Scalar> second_ = Matrix6<Scalar>::Zero();
};

}  // namespace detail

/// The density with the moments of x u v over all pairs of a sample of the state x and one of the noise v.
///
/// The scatter matrix of the orientation and E[t] are exact for any rule. Cov(t) and the coupling are as good
/// as the rule's fourth moments: take RichPoseRule or JointPoseRule for wide orientations. A long u makes
/// translation and orientation correlated through R(q) t_u. The coupling represents that; the paper, which
/// has none, drops it (keep_coupling = false). Cost: the square of the rule's points.
template <std::floating_point Scalar, PoseRule<BinghamGaussian<Scalar>> Rule>
[[nodiscard]] BinghamGaussian<Scalar> predict(const BinghamGaussian<Scalar>& state,
                                              const DualQuaternion<Scalar>& motion,
                                              const BinghamGaussian<Scalar>& noise, const Rule& rule,
                                              const MomentMatchOptions<Scalar>& options = {}) {
  using Pose = DualQuaternion<Scalar>;
  const auto orientation = compose(compose(state.orientation(), motion.rotation()), noise.orientation(),
                                   {.min_eigenvalue = options.min_eigenvalue});
  const auto state_samples = sample(rule, state);
  const auto noise_samples = sample(rule, noise);
  Matrix<Scalar, 3, Rule::kCount> noise_translations;
  for (int j = 0; j < Rule::kCount; ++j) {
    noise_translations.col(j) = Pose::unchecked(noise_samples.points.col(j)).translation();
  }

  detail::PoseMoments<Scalar> moments(orientation, (state.pose() * motion * noise.pose()).translation());
  for (int i = 0; i < Rule::kCount; ++i) {
    const Pose moved = Pose::unchecked(state_samples.points.col(i)) * motion;
    const Matrix4<Scalar> coordinates = orientation.axes().transpose() * left_matrix(moved.rotation());
    const Matrix3<Scalar> R = moved.rotation_matrix();
    const Vector3<Scalar> t = moved.translation();
    for (int j = 0; j < Rule::kCount; ++j) {
      moments.add(state_samples.weights[i] * noise_samples.weights[j],
                  coordinates * noise_samples.points.col(j).template head<4>(),
                  t + R * noise_translations.col(j));
    }
  }
  return moments.density(options.keep_coupling);
}

namespace detail {

inline constexpr std::string_view kAsymmetricNoise = "covariance of the noise is not finite or not symmetric";

}  // namespace detail

/// The first-order prediction of a concentrated state, in closed form: with w = u E[v], x exp(xi) w exp(nu) =
/// x w exp(Ad(w^-1) xi) exp(nu), so that P' = A P A^T + Q with A = Ad(w^-1). Throws unless both covariances
/// are finite and symmetric.
///
/// For rotations of tens of milliradians. Two axes known to .1 rad move a third one that is known to 1 mrad:
/// the ANEES is 31 instead of 6, at .3 rad 1900. compose(state, {motion * noise.pose, noise.covariance})
/// has 6.0.
template <std::floating_point Scalar>
[[nodiscard]] PoseGaussian<Scalar> predict_closed_form(const PoseGaussian<Scalar>& state,
                                                       const DualQuaternion<Scalar>& motion,
                                                       const PoseGaussian<Scalar>& noise) {
  return compose_first_order(state, PoseGaussian<Scalar>{motion * noise.pose, noise.covariance});
}

/// The first-order prediction in the split chart. The noise is still in the screw chart: in the axes of the
/// moving frame.
///
/// To first order in state and noise,
///
///     phi' = R_w^T phi + nu_phi,   d' = d - R [t_w]x phi + R R_w nu_rho,   w = u E[v].
///
/// Throws unless both covariances are finite and symmetric. Wide rotations need predict() with
/// Degree5Rule<12>: the first order has an ANEES of 32 instead of 6 if two axes are known to .1 rad and the
/// third to 1 mrad, and of 2000 and more if they are known to .3 rad; the rule has 6.0.
template <ConcentratedDensity Split, std::floating_point Scalar = typename Split::Scalar>
requires std::same_as<Split, SplitPoseGaussian<Scalar>>
[[nodiscard]] Split predict_closed_form(const Split& state, const DualQuaternion<Scalar>& motion,
                                        const std::type_identity_t<PoseGaussian<Scalar>>& noise) {
  detail::require_symmetric(state);
  detail::require_symmetric(noise);
  const DualQuaternion<Scalar> w = motion * noise.pose;
  const DualQuaternion<Scalar> moved = (state.pose * w).renormalized();
  Matrix6<Scalar> A = Matrix6<Scalar>::Identity();
  A.template topLeftCorner<3, 3>() = w.rotation_matrix().transpose();
  A.template bottomLeftCorner<3, 3>() = -state.pose.rotation_matrix() * skew(w.translation());
  Matrix6<Scalar> B = Matrix6<Scalar>::Identity();
  B.template bottomRightCorner<3, 3>() = moved.rotation_matrix();
  return {moved, detail::congruence<Scalar, 6, 6>(A, state.covariance) +
                     detail::congruence<Scalar, 6, 6>(B, noise.covariance)};
}

/// The prediction of a concentrated state in any chart through sigma points in R^12. With Degree5Rule<12>,
/// mean and covariance are right to second order; the 24 points of CubatureRule<12> give the mean to second
/// order, but miss what the product of two wide axes adds to a narrow one.
template <std::floating_point Scalar, class Chart, GaussianRule Rule>
requires(Rule::kDim == 12)
    [[nodiscard]] PoseGaussian<Scalar, Chart> predict(const PoseGaussian<Scalar, Chart>& state,
                                                      const DualQuaternion<Scalar>& motion,
                                                      const PoseGaussian<Scalar>& noise, const Rule& rule) {
  using Pose = DualQuaternion<Scalar>;
  return propagate(rule, state, noise, Matrix6<Scalar>(Matrix6<Scalar>::Zero()),
                   [&](const Pose& x, const Pose& v) { return x * motion * v; });
}

/// The prediction of a state of any kind, a joint one say: x <- f(x). The covariance `noise` is added to that
/// of the vector about the result. f maps a state to a state. Through the points of a rule, by default one
/// that is exact to degree 5 for up to 18 dimensions (57 points for a pose, 146 for nine dimensions), and two
/// points for every dimension of larger states. Throws unless the covariance of the state is positive
/// semidefinite, and that of the noise finite and symmetric.
template <ConcentratedDensity Density, class F, GaussianRule Rule = detail::DefaultRule<Density::Chart::kDim>>
requires std::invocable<F&, const typename Density::Chart::Point&>
[[nodiscard]] Density predict(const Density& state, F&& f,
                              const Matrix<typename Density::Scalar, Density::Chart::kDim>& noise,
                              const Rule& rule = {}) {
  detail::require_covariance<typename Density::Scalar, Density::Chart::kDim>(detail::kAsymmetricNoise, noise);
  Density moved = propagate(rule, state, std::forward<F>(f));
  moved.covariance += noise;
  return moved;
}

/// The first-order prediction x <- f(x), with the Jacobian F of f at the mean: f(retract(x, a)) =
/// retract(f(x), F a). Throws unless the covariances of state and noise are finite and symmetric. What f does
/// to second order is left out; predict(state, f, noise) includes it, for up to
/// eighteen coordinates.
template <ConcentratedDensity Density, class F>
requires std::invocable<F&, const typename Density::Chart::Point&>
[[nodiscard]] Density predict_closed_form(
    const Density& state, F&& f,
    const std::type_identity_t<Matrix<typename Density::Scalar, Density::Chart::kDim>>& jacobian,
    const std::type_identity_t<Matrix<typename Density::Scalar, Density::Chart::kDim>>& noise) {
  const auto& [mean, covariance] = state;
  constexpr int N = Density::Chart::kDim;
  detail::require_symmetric(state);
  detail::require_covariance<typename Density::Scalar, N>(detail::kAsymmetricNoise, noise);
  return {Density::Chart::normalized(f(mean)),
          detail::congruence<typename Density::Scalar, N, N>(jacobian, covariance) + noise};
}

}  // namespace antipode
