// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <antipode/detail/check.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/quaternion.hpp>

/// Mean and covariance of weighted poses in the tangent space at their mode: the fit of a push-forward
/// Gaussian.
namespace antipode::detail {

/// Weighted poses, taken apart: one row per pose, so that each coordinate of all poses is contiguous in
/// memory.
template <class Scalar>
struct PoseSample {
  Matrix<Scalar, Eigen::Dynamic, 4> rotations;
  Matrix<Scalar, Eigen::Dynamic, 3> translations;
  Vector<Scalar, Eigen::Dynamic> weights;

  /// Columns [q; p] and their weights, which are normalised to the given sum. Throws on weights that are
  /// negative or sum to zero, on anything not finite, and unless there is one weight per pose.
  PoseSample(const PoseColumns<Scalar>& poses, const Weights<Scalar>& pose_weights, Scalar sum)
      : rotations(poses.cols(), 4), translations(poses.cols(), 3) {
    if (poses.cols() != pose_weights.size()) [[unlikely]] {
      throw_invalid("there must be one weight per sample; number of weights", pose_weights.size());
    }
    weights = pose_weights * (sum / checked_sum<Scalar>(pose_weights));
    for (Eigen::Index k = 0; k < poses.cols(); ++k) {
      const auto pose = DualQuaternion<Scalar>::from_coefficients(poses.col(k));
      rotations.row(k) = pose.rotation().transpose();
      translations.row(k) = pose.translation().transpose();
    }
  }

  [[nodiscard]] Eigen::Index size() const { return weights.size(); }
  [[nodiscard]] Vector4<Scalar> rotation(Eigen::Index k) const { return rotations.row(k).transpose(); }
  [[nodiscard]] Vector3<Scalar> translation(Eigen::Index k) const { return translations.row(k).transpose(); }
};

/// The principal axis of sum w q q^T: the mean rotation, whatever the signs of the q.
template <class Scalar>
[[nodiscard]] Vector4<Scalar> mean_rotation(const PoseSample<Scalar>& sample,
                                            const Weights<Scalar>& weights) {
  Matrix4<Scalar> scatter;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j <= i; ++j) {
      const auto products = sample.rotations.col(i).array() * sample.rotations.col(j).array();
      scatter(i, j) = scatter(j, i) = (weights.array() * products).sum();
    }
  }
  return symmetric_eigen(scatter).vectors.col(3);
}

/// sum w t / sum w.
template <class Scalar>
[[nodiscard]] Vector3<Scalar> mean_translation(const PoseSample<Scalar>& sample,
                                               const Weights<Scalar>& weights) {
  Vector3<Scalar> mean;
  for (int i = 0; i < 3; ++i) mean[i] = sample.translations.col(i).dot(weights);
  return mean / weights.sum();
}

/// The coordinates (u, t) - reference of up to kSize consecutive samples in the tangent space of q0, one
/// array per coordinate.
template <class Scalar>
struct TangentBlock {
  static constexpr Eigen::Index kSize = 128;
  using Array = Eigen::Array<Scalar, Eigen::Dynamic, 1, 0, kSize, 1>;

  Array r0;                ///< |q0.q| = (1 + |u|^2)^-1/2
  std::array<Array, 6> y;  ///< where r0 < least_r0, u is computed as if r0 were 1

  TangentBlock(const Matrix4<Scalar>& to_chart, const Vector6<Scalar>& reference,
               const PoseSample<Scalar>& sample, Eigen::Index first, Scalar least_r0) {
    const Eigen::Index count = std::min(kSize, sample.size() - first);
    const auto rotated = [&](int i) -> Array {
      return to_chart(i, 0) * sample.rotations.col(0).segment(first, count).array() +
             to_chart(i, 1) * sample.rotations.col(1).segment(first, count).array() +
             to_chart(i, 2) * sample.rotations.col(2).segment(first, count).array() +
             to_chart(i, 3) * sample.rotations.col(3).segment(first, count).array();
    };
    r0 = rotated(0);
    const Array inverse = (r0.abs() < least_r0).select(Scalar(1), r0).inverse();
    r0 = r0.abs();
    for (std::size_t i = 0; i < 3; ++i) {
      const int k = static_cast<int>(i);
      y[i] = rotated(k + 1) * inverse - reference[k];
      y[i + 3] = sample.translations.col(k).segment(first, count).array() - reference[k + 3];
    }
  }
};

/// Moments of (u, t) in the tangent space of q0. Samples with |q0.q| < 1e-3, nearly a half-turn away, are
/// left out.
template <class Scalar>
struct TangentMoments {
  Scalar weight = 0;
  TangentGaussian<Scalar> density;

  TangentMoments(const Vector4<Scalar>& q0, const PoseSample<Scalar>& sample, const Weights<Scalar>& weights,
                 const Vector6<Scalar>& reference) {
    using Block = TangentBlock<Scalar>;
    constexpr Scalar kEquator = Scalar(1e-3);
    const Matrix4<Scalar> to_chart = left_matrix(conjugate(q0));
    Vector6<Scalar> sum = Vector6<Scalar>::Zero();
    Matrix6<Scalar> squares = Matrix6<Scalar>::Zero();  // lower triangle
    for (Eigen::Index first = 0; first < sample.size(); first += Block::kSize) {
      const Block block(to_chart, reference, sample, first, kEquator);
      const auto run = weights.segment(first, block.r0.size()).array();
      const typename Block::Array w = (block.r0 < kEquator).select(Scalar(0), run);
      const Scalar block_weight = w.sum();
      if (!(block_weight > Scalar(0))) continue;
      weight += block_weight;
      for (std::size_t j = 0; j < 6; ++j) {
        const typename Block::Array weighted = w * block.y[j];
        sum[static_cast<int>(j)] += weighted.sum();
        for (std::size_t i = j; i < 6; ++i) {
          squares(static_cast<int>(i), static_cast<int>(j)) += (weighted * block.y[i]).sum();
        }
      }
    }
    const Vector6<Scalar> mean = sum / weight;
    density.mean = reference + mean;
    for (int j = 0; j < 6; ++j) {
      for (int i = j; i < 6; ++i) {
        density.covariance(i, j) = density.covariance(j, i) = squares(i, j) / weight - mean[i] * mean[j];
      }
    }
  }
};

}  // namespace antipode::detail
