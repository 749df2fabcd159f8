// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <concepts>
#include <cstddef>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/detail/chart_moments.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/projected_gaussian_conversions.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>

/// @file
/// Pose densities from one chart to another.
namespace antipode {

/// The density with the mean and the covariance of `density` in another chart of poses:
/// in_chart<SplitChart<double>>(x), in_chart<ScrewChart<double>>(y).
///
/// By the 57 points of MysovskikhRule<6>: mean and covariance are exact if the change of charts is quadratic.
/// The mean moves by about half the product of the standard deviations of rotation and position, and a
/// Gaussian in one chart is bent in the other: choose the chart in which the first measurement is linear, and
/// do not change it. Throws unless the covariance is positive semidefinite.
template <class To, std::floating_point Scalar, class From>
requires std::same_as<typename To::Point, DualQuaternion<Scalar>>
[[nodiscard]] PoseGaussian<Scalar, To> in_chart(const PoseGaussian<Scalar, From>& density) {
  if constexpr (std::same_as<To, From>) {
    (void)detail::root_of(density);
    return density;
  } else {
    using Rule = MysovskikhRule<6>;
    const auto root = detail::root_of(density);
    const auto standard = Rule{}.template standard<Scalar>();
    std::array<DualQuaternion<Scalar>, static_cast<std::size_t>(Rule::kCount)> poses;
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Vector6<Scalar> g = standard.points.col(static_cast<int>(k));
      poses[k] = From::retract(density.pose, root.L * g);
    }
    return detail::chart_moments<PoseGaussian<Scalar, To>>(density.pose, poses, standard.weights);
  }
}

namespace detail {

/// The covariance with the error of the position rotated by R.
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> with_turned_position(const Matrix6<Scalar>& covariance,
                                                   const Matrix3<Scalar>& R) {
  Matrix6<Scalar> A = Matrix6<Scalar>::Identity();
  A.template bottomRightCorner<3, 3>() = R;
  return congruence<Scalar, 6, 6>(A, covariance);
}

}  // namespace detail

/// The density in the split chart. Right to first order in the rotation's covariance, and exact for the
/// position, which both densities hold in the axes of the parent.
template <std::floating_point Scalar>
[[nodiscard]] SplitPoseGaussian<Scalar> to_split_pose_gaussian(const BinghamGaussian<Scalar>& density) {
  return {density.pose(),
          detail::with_turned_position<Scalar>(density.covariance(), density.pose().rotation_matrix())};
}

/// The inverse of to_split_pose_gaussian. Throws unless the covariance is symmetric and positive
/// semidefinite, and if the rotation is too wide (see to_bingham_gaussian of a PoseGaussian).
template <std::floating_point Scalar>
[[nodiscard]] BinghamGaussian<Scalar> to_bingham_gaussian(const SplitPoseGaussian<Scalar>& density) {
  detail::require_symmetric(density);
  const Matrix3<Scalar> R = density.pose.rotation_matrix();
  return to_bingham_gaussian(PoseGaussian<Scalar>{
      density.pose, detail::with_turned_position<Scalar>(density.covariance, R.transpose())});
}

}  // namespace antipode
