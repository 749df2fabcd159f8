// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <random>
#include <stdexcept>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/standard_normal.hpp>
#include <antipode/distributions/bingham.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/gaussian.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// Draws, distances and marginals of a PoseGaussian in any chart.
namespace antipode {

/// A draw. Throws unless the covariance is symmetric and positive semidefinite.
template <std::floating_point Scalar, class Chart, std::uniform_random_bit_generator Rng>
[[nodiscard]] DualQuaternion<Scalar> sample(const PoseGaussian<Scalar, Chart>& x, Rng& rng) {
  const auto root = detail::root_of_covariance<Scalar, 6>(
      "pose covariance has a negative eigenvalue",
      detail::checked_covariance<Scalar, 6>("pose covariance is not finite or not symmetric", x.covariance));
  const Vector6<Scalar> xi = root.L * detail::standard_normal<Scalar, 6>(rng);
  return Chart::retract(x.pose, xi);
}

/// e^T P^-1 e with e = Chart::local(x.pose, pose), log(x.pose^-1 pose) for the screw chart: chi-square, six
/// degrees of freedom for draws of x. Throws std::domain_error if the covariance is singular or indefinite:
/// there are poses at no finite distance then.
template <std::floating_point Scalar, class Chart>
[[nodiscard]] Scalar mahalanobis_squared(const PoseGaussian<Scalar, Chart>& x,
                                         const DualQuaternion<Scalar>& pose) {
  const auto L = detail::cholesky_factor<Scalar, 6>(
      detail::checked_covariance<Scalar, 6>("pose covariance is not finite or not symmetric", x.covariance));
  if (!L) [[unlikely]] {
    throw std::domain_error("a pose density with a singular covariance has no Mahalanobis distance");
  }
  return detail::solve_lower<Scalar, 6, 1>(*L, Chart::local(x.pose, pose)).squaredNorm();
}

/// The normalised estimation error squared (NEES) of an estimate, given the true pose: mahalanobis_squared.
/// It is 6 on average if the covariance is right, and more if it is too small (ANEES is the average over many
/// independent runs). Throws as mahalanobis_squared does.
template <std::floating_point Scalar, class Chart>
[[nodiscard]] Scalar nees(const PoseGaussian<Scalar, Chart>& estimate, const DualQuaternion<Scalar>& truth) {
  return mahalanobis_squared(estimate, truth);
}

/// The position in the axes of the parent frame, as a GPS receiver measures it: mean and covariance [m, m^2]
/// to second order in the rotation. Throws unless the covariance is symmetric and positive semidefinite.
template <std::floating_point Scalar, class Chart>
[[nodiscard]] Gaussian<Scalar, 3> translation_marginal(const PoseGaussian<Scalar, Chart>& x) {
  const auto root = detail::root_of_covariance<Scalar, 6>(
      "pose covariance has a negative eigenvalue",
      detail::checked_covariance<Scalar, 6>("pose covariance is not finite or not symmetric", x.covariance));
  const auto standard = MysovskikhRule<6>().template standard<Scalar>();
  const Vector3<Scalar> center = x.pose.translation();
  Vector3<Scalar> mean = Vector3<Scalar>::Zero();
  Matrix3<Scalar> covariance = Matrix3<Scalar>::Zero();
  for (int k = 0; k < MysovskikhRule<6>::kCount; ++k) {
    const Vector6<Scalar> xi = root.L * standard.points.col(k);
    const Vector3<Scalar> t = Chart::retract(x.pose, xi).translation() - center;
    mean += standard.weights[k] * t;
    detail::add_outer_product(standard.weights[k], t, t, covariance);
  }
  detail::add_outer_product(Scalar(-1), mean, mean, covariance);
  return {center + mean, covariance};
}

/// The orientation by itself, as a density on S^3. Throws if it is too wide, as to_bingham_gaussian() does.
template <std::floating_point Scalar, class Chart>
[[nodiscard]] Bingham<Scalar, 4> orientation_marginal(const PoseGaussian<Scalar, Chart>& x) {
  return to_bingham_gaussian(PoseGaussian<Scalar>{x.pose, x.covariance}).orientation();
}

}  // namespace antipode
