// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <antipode/detail/check.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/detail/symmetric_eigen.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// Mean and covariance of weighted poses in the tangent space at their mode: the fit of a push-forward
/// Gaussian.
namespace antipode::detail {

/// Weighted poses taken apart, one column each.
template <class Scalar>
struct PoseSample {
  Matrix<Scalar, 4, Eigen::Dynamic> rotations;
  Matrix<Scalar, 3, Eigen::Dynamic> translations;
  Vector<Scalar, Eigen::Dynamic> weights;

  /// Columns [q; p] and their weights, which are normalised to the given sum. Throws on weights that are
  /// negative or sum to zero, and on anything not finite.
  PoseSample(const PoseColumns<Scalar>& poses, const Weights<Scalar>& pose_weights, Scalar sum)
      : rotations(4, poses.cols()), translations(3, poses.cols()) {
    if (poses.cols() != pose_weights.size()) [[unlikely]] {
      throw_invalid("there must be one weight a sample, weights", pose_weights.size());
    }
    weights = pose_weights * (sum / checked_sum<Scalar>(pose_weights));
    for (Eigen::Index k = 0; k < poses.cols(); ++k) {
      const auto pose = DualQuaternion<Scalar>::from_coefficients(poses.col(k));
      rotations.col(k) = pose.rotation();
      translations.col(k) = pose.translation();
    }
  }

  [[nodiscard]] Eigen::Index size() const { return weights.size(); }
};

/// The principal axis of sum w q q^T, the mean rotation whatever the signs.
template <class Scalar>
[[nodiscard]] Vector4<Scalar> mean_rotation(const PoseSample<Scalar>& sample,
                                            const Weights<Scalar>& weights) {
  Matrix4<Scalar> scatter = Matrix4<Scalar>::Zero();
  for (Eigen::Index k = 0; k < sample.size(); ++k) {
    const Vector4<Scalar> q = sample.rotations.col(k);
    add_outer_product(weights[k], q, q, scatter);
  }
  return symmetric_eigen(scatter).vectors.col(3);
}

/// Moments of (u, t) in the tangent space of q0. Rotations within 1e-3 of its equator do not count.
template <class Scalar>
struct TangentMoments {
  Scalar weight = 0;
  TangentGaussian<Scalar> density;

  TangentMoments(const Vector4<Scalar>& q0, const PoseSample<Scalar>& sample, const Weights<Scalar>& weights,
                 const Vector6<Scalar>& reference) {
    using std::abs;
    constexpr Scalar kEquator(1e-3);
    const Matrix4<Scalar> to_chart = left_matrix(conjugate(q0));
    Vector6<Scalar> sum = Vector6<Scalar>::Zero();
    Matrix6<Scalar> squares = Matrix6<Scalar>::Zero();
    for (Eigen::Index k = 0; k < sample.size(); ++k) {
      if (!(weights[k] > Scalar(0))) continue;
      const Vector4<Scalar> r = to_chart * sample.rotations.col(k);
      if (abs(r[0]) < kEquator) continue;
      Vector6<Scalar> y;
      y << r.template tail<3>() / r[0], sample.translations.col(k);
      y -= reference;
      weight += weights[k];
      sum += weights[k] * y;
      add_outer_product(weights[k], y, y, squares);
    }
    const Vector6<Scalar> mean = sum / weight;
    add_outer_product(-weight, mean, mean, squares);
    density = {reference + mean, symmetrized<Scalar, 6>(squares / weight)};
  }
};

}  // namespace antipode::detail
