// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <concepts>
#include <cstddef>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// Products, inverses and differences of uncertain poses.
///
/// Two poses are x = x0 exp(a) and y = y0 exp(b) with zero-mean a and b, which may be correlated: `cross` is
/// E[a b^T], zero if they are independent. The closed forms are of first order; propagate() follows any
/// function through sigma points, with a few dozen calls, and is correct to second order. Both are
/// for concentrated poses. Source: adjoint calculus of SE(3), as for example in Sola, Deray, Atchuthan, "A
/// micro Lie theory for state estimation in robotics", 2018.
namespace antipode {

namespace detail {

/// Cov(A a + b) for covariances P of a, Q of b and C = E[a b^T].
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> covariance_of_sum(const Matrix6<Scalar>& A, const Matrix6<Scalar>& P,
                                                const Matrix6<Scalar>& Q, const Matrix6<Scalar>& C) {
  const Matrix6<Scalar> AC = A * C;
  return congruence<Scalar, 6, 6>(A, P) + Q + AC + AC.transpose();
}

}  // namespace detail

/// The density of x y: x maps the middle frame to the outer one, y the inner frame to the middle one.
template <std::floating_point Scalar>
[[nodiscard]] PoseGaussian<Scalar> compose(const PoseGaussian<Scalar>& x, const PoseGaussian<Scalar>& y,
                                           const Matrix6<Scalar>& cross = Matrix6<Scalar>::Zero()) {
  // x exp(a) y exp(b) = x y exp(Ad(y^-1) a) exp(b)
  const Matrix6<Scalar> A = y.pose.inverse().adjoint();
  return {(x.pose * y.pose).renormalized(),
          detail::covariance_of_sum<Scalar>(A, x.covariance, y.covariance, cross)};
}

/// The density of the inverse of x. To first order its error is -Ad(x) a.
template <std::floating_point Scalar>
[[nodiscard]] PoseGaussian<Scalar> inverse(const PoseGaussian<Scalar>& x) {
  return {x.pose.inverse(), detail::congruence<Scalar, 6, 6>(x.pose.adjoint(), x.covariance)};
}

/// The density of x^-1 y, the pose of y as seen from x. Where both are known from the same map `cross` is
/// most of their covariances, and leaving it out makes the relative pose look worse than it is.
template <std::floating_point Scalar>
[[nodiscard]] PoseGaussian<Scalar> relative_pose(const PoseGaussian<Scalar>& x, const PoseGaussian<Scalar>& y,
                                                 const Matrix6<Scalar>& cross = Matrix6<Scalar>::Zero()) {
  // exp(-a) x^-1 y exp(b) = z exp(-Ad(z^-1) a) exp(b) with z = x^-1 y
  const DualQuaternion<Scalar> z = (x.pose.inverse() * y.pose).renormalized();
  const Matrix6<Scalar> A = -z.inverse().adjoint();
  return {z, detail::covariance_of_sum<Scalar>(A, x.covariance, y.covariance, cross)};
}

namespace detail {

/// The mean and the covariance of weighted poses: the point where their tangent vectors sum to zero.
template <class Scalar, std::size_t Count>
[[nodiscard]] PoseGaussian<Scalar> moments_of(const std::array<DualQuaternion<Scalar>, Count>& poses,
                                              const Vector<Scalar, static_cast<int>(Count)>& weights) {
  constexpr int kMostIterations = 10;
  constexpr Scalar kSettled(1e-3);  // of the spread: the mean moves by less than its square next time
  PoseGaussian<Scalar> result{poses[0], Matrix6<Scalar>::Zero()};
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    Vector6<Scalar> mean = Vector6<Scalar>::Zero();
    result.covariance.setZero();
    for (std::size_t k = 0; k < Count; ++k) {
      const Vector6<Scalar> xi = poses[k].boxminus(result.pose);
      const Scalar weight = weights[static_cast<int>(k)];
      mean += weight * xi;
      add_outer_product<Scalar, 6, 6>(weight, xi, xi, result.covariance);
    }
    if (mean.squaredNorm() <= kSettled * kSettled * result.covariance.trace()) {
      add_outer_product<Scalar, 6, 6>(Scalar(-1), mean, mean, result.covariance);
      result.pose = result.pose.boxplus(mean).renormalized();
      return result;
    }
    result.pose = result.pose.boxplus(mean).renormalized();
  }
  return result;
}

}  // namespace detail

/// The density of f(x) by the points of a rule in R^6. f returns a DualQuaternion. Throws unless the
/// covariance is positive semidefinite.
template <GaussianRule Rule, std::floating_point Scalar, class F>
requires(Rule::kDim == 6)
    [[nodiscard]] PoseGaussian<Scalar> propagate(const Rule& rule, const PoseGaussian<Scalar>& x, F&& f) {
  const auto root = detail::root_of_covariance<Scalar, 6>(
      "pose covariance has a negative eigenvalue",
      detail::checked_symmetric<Scalar, 6>("pose covariance is not finite or not symmetric", x.covariance));
  const auto standard = rule.template standard<Scalar>();
  std::array<DualQuaternion<Scalar>, static_cast<std::size_t>(Rule::kCount)> poses;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Vector6<Scalar> g = standard.points.col(static_cast<int>(k));
    poses[k] = f(x.pose.boxplus(root.L * g));
  }
  return detail::moments_of<Scalar>(poses, standard.weights);
}

/// The density of f(x, y) by the points of a rule in R^12, CubatureRule<12> say. Throws unless the joint
/// covariance is positive semidefinite.
template <GaussianRule Rule, std::floating_point Scalar, class F>
requires(Rule::kDim == 12)
    [[nodiscard]] PoseGaussian<Scalar> propagate(const Rule& rule, const PoseGaussian<Scalar>& x,
                                                 const PoseGaussian<Scalar>& y, const Matrix6<Scalar>& cross,
                                                 F&& f) {
  Matrix<Scalar, 12> joint;
  joint.template topLeftCorner<6, 6>() = x.covariance;
  joint.template bottomRightCorner<6, 6>() = y.covariance;
  joint.template topRightCorner<6, 6>() = cross;
  joint.template bottomLeftCorner<6, 6>() = cross.transpose();
  const auto root = detail::root_of_covariance<Scalar, 12>(
      "joint covariance of two poses has a negative eigenvalue",
      detail::checked_symmetric<Scalar, 12>("joint covariance of two poses is not finite or not symmetric",
                                            joint));
  const auto standard = rule.template standard<Scalar>();
  std::array<DualQuaternion<Scalar>, static_cast<std::size_t>(Rule::kCount)> poses;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Vector<Scalar, 12> g = standard.points.col(static_cast<int>(k));
    const Vector<Scalar, 12> ab = root.L * g;
    poses[k] = f(x.pose.boxplus(ab.template head<6>()), y.pose.boxplus(ab.template tail<6>()));
  }
  return detail::moments_of<Scalar>(poses, standard.weights);
}

}  // namespace antipode
