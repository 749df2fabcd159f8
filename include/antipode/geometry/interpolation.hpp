// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <string>

#include <antipode/detail/check.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Screw interpolation and means of poses. The results do not depend on the signs of the arguments.
namespace antipode {

/// The pose at `tau` on the screw motion from a (tau = 0) to b (tau = 1); tau outside [0, 1] extrapolates.
///
/// ScLERP, a exp(tau log(a^-1 b)): constant velocity, the shorter way round; at a relative rotation of pi,
/// one of the two. Throws unless tau is finite. Reference: L. Kavan et al., "Dual Quaternions for Rigid
/// Transformation Blending", 2006.
template <class A, class B>
[[nodiscard]] auto sclerp(const BasicDualQuaternion<A>& a, const BasicDualQuaternion<B>& b,
                          const typename A::Scalar& tau) {
  return a.boxplus(tau * b.boxminus(a));
}

/// When the iteration of a mean ends.
struct PoseMeanOptions {
  int max_iterations = 50;  ///< most steps
  /// Step that counts as converged, in units of rounding errors: of a rotation, and of the longest
  /// translation.
  double tolerance = 16.0;
};

/// The result of mean().
template <class Scalar>
struct PoseMean {
  DualQuaternion<Scalar> pose;  ///< the mean
  int iterations = 0;           ///< steps taken
  /// False if the iteration did not settle, as for poses spread over more than half a turn.
  bool converged = false;
};

/// The group mean m of weighted poses (columns [q; p]): sum_k w_k log(m^-1 x_k) = 0. The weights need not be
/// normalised; their sum may overflow.
///
/// A change of the parent or of the child frame changes the mean in the same way. This does not hold for a
/// mean of the translations beside a mean of the rotations. Starts from the principal axis of sum w q q^T and
/// the mean translation, then repeats m <- m exp(sum w log(m^-1 x)). Throws if a pose is not unit, if a
/// weight is negative or not finite, if all weights are zero, or unless there is one weight per pose.
///
/// Reference: X. Pennec and V. Arsigny, "Exponential Barycenters of the Canonical Cartan Connection and
/// Invariant Means on Lie Groups", 2013.
template <class Poses, class Weights>
requires(Poses::RowsAtCompileTime == 8 && Weights::ColsAtCompileTime == 1)
    [[nodiscard]] auto mean(const Eigen::MatrixBase<Poses>& poses, const Eigen::MatrixBase<Weights>& weights,
                            const PoseMeanOptions& options = {}) {
  using Scalar = typename Poses::Scalar;
  using Pose = DualQuaternion<Scalar>;
  bool valid = weights.size() == poses.cols();
  Scalar largest(0);
  for (Eigen::Index k = 0; k < weights.size(); ++k) {
    valid &= detail::is_finite(weights[k]) && weights[k] >= Scalar(0);
    largest = std::max<Scalar>(largest, weights[k]);
  }
  if (!valid || !(largest > Scalar(0))) [[unlikely]] {
    detail::throw_invalid("mean of " + std::to_string(poses.cols()) + " poses with invalid weights",
                          weights.transpose().eval());
  }
  Scalar total = weights.sum(), unit(1);  // of the weights
  if (!detail::is_finite(total)) [[unlikely]] {
    unit = largest;
    total = (weights / unit).sum();
  }

  Matrix4<Scalar> scatter = Matrix4<Scalar>::Zero();
  Vector3<Scalar> translation = Vector3<Scalar>::Zero();
  for (Eigen::Index k = 0; k < poses.cols(); ++k) {
    const Pose x = Pose::from_coefficients(poses.col(k));
    const Scalar share = weights[k] / unit / total;
    detail::add_outer_product<Scalar, 4, 4>(share, x.real(), x.real(), scatter);
    translation += share * x.translation();
  }
  const Vector4<Scalar> axis = detail::symmetric_eigen<Scalar, 4>(scatter).vectors.col(3);
  PoseMean<Scalar> result{.pose = Pose::from_rotation_translation(axis, translation)};

  const Scalar rounding = Scalar(2) * Scalar(options.tolerance) * Eigen::NumTraits<Scalar>::epsilon();
  const Scalar longest = poses.template bottomRows<4>().cwiseAbs().maxCoeff();
  while (!result.converged && result.iterations < options.max_iterations) {
    Vector6<Scalar> step = Vector6<Scalar>::Zero();
    for (Eigen::Index k = 0; k < poses.cols(); ++k) {
      step += weights[k] / unit / total * Pose::unchecked(poses.col(k)).boxminus(result.pose);
    }
    result.pose = result.pose.boxplus(step).renormalized();
    result.converged =
        step.template head<3>().norm() <= rounding && step.template tail<3>().norm() <= rounding * longest;
    ++result.iterations;
  }
  return result;
}

/// The group mean of weighted samples.
template <class Scalar, int Count>
[[nodiscard]] PoseMean<Scalar> mean(const WeightedSamples<Scalar, 8, Count>& samples,
                                    const PoseMeanOptions& options = {}) {
  return mean(samples.points, samples.weights, options);
}

}  // namespace antipode
