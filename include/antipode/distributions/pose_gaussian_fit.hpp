// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include <antipode/detail/check.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/detail/chart_moments.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// The PoseGaussian of samples: of a particle filter, of repeated measurements, of the runs of a simulation.
namespace antipode {

/// The density with the mean and the covariance of weighted poses (the columns [q; p]; the weights need not
/// be normalised): the mean about which their weighted vectors in the chart sum to zero, and the covariance
/// of these vectors. fit_pose_gaussian<SplitChart>(points, weights) is the one for rotation and position
/// apart.
///
/// The signs of the poses do not matter. The covariance is that of the samples, divided by the sum of the
/// weights: singular for fewer than seven of them. Throws on a pose that is not unit, on weights that are
/// negative or sum to zero, on anything not finite, unless there is one weight per pose, and if the rotations
/// are spread too widely to have a mean.
template <template <class> class C = ScrewChart, class Points, class Weights>
requires(Points::RowsAtCompileTime == 8)
    [[nodiscard]] PoseGaussian<typename Points::Scalar, C<typename Points::Scalar>> fit_pose_gaussian(
        const Eigen::MatrixBase<Points>& points, const Eigen::MatrixBase<Weights>& weights) {
  using Scalar = typename Points::Scalar;
  using Chart = C<Scalar>;
  using Pose = DualQuaternion<Scalar>;
  constexpr int kMostIterations = 100;
  constexpr Scalar kSettled = std::max(Scalar(1e-9), Scalar(32) * std::numeric_limits<Scalar>::epsilon());
  if (points.cols() != weights.size()) [[unlikely]] {
    detail::throw_invalid("there must be one weight per sample; number of weights", weights.size());
  }
  const Vector<Scalar, Eigen::Dynamic> shares = weights / detail::checked_sum<Scalar>(weights);
  std::vector<Pose> poses;
  Matrix4<Scalar> scatter = Matrix4<Scalar>::Zero();
  Vector3<Scalar> translation = Vector3<Scalar>::Zero();
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const Pose& x = poses.emplace_back(Pose::from_coefficients(points.col(k)));
    detail::add_outer_product<Scalar, 4, 4>(shares[k], x.real(), x.real(), scatter);
    translation += shares[k] * x.translation();
  }
  const Vector4<Scalar> axis = detail::symmetric_eigen<Scalar, 4>(scatter).vectors.col(3);
  Pose center = Pose::from_rotation_translation(axis, translation);
  const Scalar epsilon = Scalar(64) * std::numeric_limits<Scalar>::epsilon();
  Vector6<Scalar> rounding = Vector6<Scalar>::Constant(epsilon);
  rounding.template tail<3>() *= points.template bottomRows<4>().cwiseAbs().maxCoeff();
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const detail::MomentsAbout<Chart> moments(
        center, static_cast<int>(poses.size()),
        [&](int k) -> const Pose& { return poses[static_cast<std::size_t>(k)]; }, shares);
    center = Chart::normalized(Chart::retract(center, moments.mean));
    if (detail::is_short_step<Scalar, 6>(moments.mean, moments.second, kSettled, rounding)) {
      return {center, detail::without_rounding<Scalar, 6>(moments.covariance())};
    }
  }
  detail::throw_invalid("the rotations of the samples have no mean, last at", center.rotation());
}

}  // namespace antipode
