// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <antipode/detail/check.hpp>
#include <antipode/distributions/detail/positive_semidefinite.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/pose_gaussian.hpp>
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
};

/// N(mean, L L^T) times exp(l), normalised.
template <class Scalar>
[[nodiscard]] ConditionedGaussian<Scalar> condition(const Vector6<Scalar>& mean, const Matrix6<Scalar>& L,
                                                    const QuadraticLogLikelihood<Scalar>& l) {
  const Matrix6<Scalar> information = Matrix6<Scalar>::Identity() + L.transpose() * l.curvature * L;
  const Eigen::LLT<Matrix6<Scalar>> factor(information);
  const Vector6<Scalar> H_mean = l.curvature * mean;
  const Vector6<Scalar> slope = L.transpose() * (l.gradient - H_mean);
  const Vector6<Scalar> step = factor.solve(slope);
  return {mean + L * step, factor.matrixL().solve(Matrix6<Scalar>(L.transpose())).transpose(),
          l.constant + mean.dot(l.gradient - Scalar(0.5) * H_mean) + Scalar(0.5) * slope.dot(step) -
              factor.matrixLLT().diagonal().array().log().sum()};
}

/// A pose density by a root of its covariance.
template <class Scalar>
struct RootedPose {
  DualQuaternion<Scalar> pose;
  Matrix6<Scalar> L;
  bool invertible = true;  ///< L is

  /// Throws unless the density is finite with a positive semidefinite covariance.
  [[nodiscard]] static RootedPose of(const PoseGaussian<Scalar>& density) {
    require_finite("pose is not finite", density.pose.coeffs());
    const auto root = root_of_covariance<Scalar, 6>(
        "pose covariance has a negative eigenvalue",
        checked_symmetric<Scalar, 6>("pose covariance is not finite or not symmetric", density.covariance));
    return {density.pose, root.L, root.positive_definite};
  }

  /// The density of pose exp(L y) for y of the given Gaussian: the mean moves, and with it the tangent space.
  [[nodiscard]] RootedPose moved(const ConditionedGaussian<Scalar>& y) const {
    const Vector6<Scalar> xi = L * y.mean;
    return {pose.boxplus(xi).renormalized(), se3_right_jacobian(xi) * L * y.root, invertible};
  }

  /// `prior` times exp(l), with l in this density's coordinates y, and so the result. L must be invertible.
  [[nodiscard]] ConditionedGaussian<Scalar> condition_prior(const RootedPose& prior,
                                                            const QuadraticLogLikelihood<Scalar>& l) const {
    const Vector6<Scalar> to_prior = prior.pose.boxminus(pose);
    const Eigen::PartialPivLU<Matrix6<Scalar>> root(L);
    const Matrix6<Scalar> prior_root = root.solve(se3_right_jacobian_inverse(to_prior) * prior.L);
    return condition<Scalar>(root.solve(to_prior), prior_root, l);
  }

  [[nodiscard]] PoseGaussian<Scalar> density() const { return {pose, L * L.transpose()}; }
};

}  // namespace antipode::detail
