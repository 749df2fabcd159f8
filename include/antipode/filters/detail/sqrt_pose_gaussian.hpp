// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/solve.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/jacobians.hpp>

/// Conditioning a concentrated pose density on a quadratic log-likelihood, in whitened coordinates y: the
/// pose is mean exp(L y) with y ~ N(0, I).
namespace antipode::detail {

/// l(y) = constant + gradient.y - y^T curvature y/2, with a positive semidefinite curvature.
template <class Scalar>
struct QuadraticLogLikelihood {
  Scalar constant = Scalar(0);
  Vector6<Scalar> gradient = Vector6<Scalar>::Zero();
  Matrix6<Scalar> curvature = Matrix6<Scalar>::Zero();

  [[nodiscard]] QuadraticLogLikelihood scaled(Scalar power) const {
    return {power * constant, power * gradient, power * curvature};
  }
};

/// A Gaussian N(mean, root root^T) and the evidence of the measurement that made it.
template <class Scalar>
struct ConditionedGaussian {
  Vector6<Scalar> mean;
  Matrix6<Scalar> root;
  Scalar log_evidence;

  [[nodiscard]] bool finite() const { return mean.allFinite() && root.allFinite(); }
};

/// N(mean, L L^T) times exp(l), normalised. Not a number where l is too large to compute with.
template <class Scalar>
[[nodiscard]] ConditionedGaussian<Scalar> condition(const Vector6<Scalar>& mean, const Matrix6<Scalar>& L,
                                                    const QuadraticLogLikelihood<Scalar>& l) {
  using std::log;
  const Matrix6<Scalar> Lt = L.transpose();
  const Matrix6<Scalar> H = congruence<Scalar, 6, 6>(Lt, l.curvature);
  // No pivot of I + H is below one; rounding may violate that for a steep likelihood.
  const Matrix6<Scalar> C =
      cholesky_factor<Scalar, 6>(Matrix6<Scalar>::Identity() + H, Scalar(1))
          .value_or(Matrix6<Scalar>::Constant(std::numeric_limits<Scalar>::quiet_NaN()));
  const Matrix6<Scalar> root = solve_lower<Scalar, 6, 6>(C, Lt).transpose();
  const Vector6<Scalar> H_mean = l.curvature * mean;
  const Vector6<Scalar> slope = l.gradient - H_mean;
  const Vector6<Scalar> step = root.transpose() * slope;
  Scalar log_evidence =
      l.constant + Scalar(0.5) * (mean.dot(l.gradient) + mean.dot(slope) + step.squaredNorm());
  for (int i = 0; i < 6; ++i) log_evidence -= log(C(i, i));
  return {mean + root * step, root, log_evidence};
}

/// A pose density by a root of its covariance.
template <class Scalar>
struct SqrtPoseGaussian {
  DualQuaternion<Scalar> pose;
  Matrix6<Scalar> L;
  bool invertible = true;  ///< L is

  /// Throws unless the density is finite with a positive semidefinite covariance.
  [[nodiscard]] static SqrtPoseGaussian of(const PoseGaussian<Scalar>& density) {
    require_finite("pose is not finite", density.pose.coeffs());
    const auto root = root_of_covariance<Scalar, 6>(
        "pose covariance has a negative eigenvalue",
        checked_symmetric<Scalar, 6>("pose covariance is not finite or not symmetric", density.covariance));
    return {density.pose, root.L, root.positive_definite};
  }

  /// The density of pose exp(L y) for y of the given Gaussian: the mean moves, and with it the tangent space.
  /// Nothing if y leads more than half a turn away, where there is no such tangent vector, or overflows.
  [[nodiscard]] std::optional<SqrtPoseGaussian> moved(const ConditionedGaussian<Scalar>& y) const {
    const Vector6<Scalar> xi = L * y.mean;
    const Matrix6<Scalar> L_root = L * y.root;
    const bool reachable =
        std::isfinite(xi.squaredNorm()) && xi.template head<3>().norm() <= std::numbers::pi_v<Scalar>;
    if (!reachable || !std::isfinite(L_root.squaredNorm())) return std::nullopt;
    SqrtPoseGaussian result{pose.boxplus(xi).renormalized(), se3_right_jacobian(xi) * L_root, invertible};
    if (!std::isfinite(result.L.squaredNorm())) return std::nullopt;
    return result;
  }

  /// `prior` times exp(l), with l in this density's coordinates y, and so the result. L must be invertible.
  [[nodiscard]] ConditionedGaussian<Scalar> condition_prior(const SqrtPoseGaussian& prior,
                                                            const QuadraticLogLikelihood<Scalar>& l) const {
    const Vector6<Scalar> to_prior = prior.pose.boxminus(pose);
    Matrix<Scalar, 6, 7> mean_and_root;
    mean_and_root.col(0) = to_prior;
    mean_and_root.template rightCols<6>() = se3_right_jacobian_inverse(to_prior) * prior.L;
    const Matrix<Scalar, 6, 7> whitened = solve<Scalar, 6, 7>(L, mean_and_root);
    return condition<Scalar>(whitened.col(0), whitened.template rightCols<6>(), l);
  }

  [[nodiscard]] PoseGaussian<Scalar> density() const { return {pose, L * L.transpose()}; }
};

}  // namespace antipode::detail
