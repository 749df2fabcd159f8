// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <antipode/eigen_types.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/tracking/landmark_block.hpp"

namespace stereo_slam {

/// Log-likelihood of camera poses given matched landmarks (eq. 13, without constants):
///
///   l(x) = -1/2 sum_j min( e_j' S_j^-1 e_j, cap ),   e_j = z_j - h(x, l_j)
///
/// Every pose projects every landmark anew; S_j (landmark and pixel noise) is that of the match and does not
/// depend on x. A landmark behind a sampled camera costs `cap`. The object keeps no references to its
/// arguments.
///
/// Let the landmarks' errors be correlated with the prior's, C_j = Cov(l_j, xi), where the prior has the
/// covariance P. At the pose x = prior exp(xi) their expected errors are C_j P^-1 xi. The remaining errors
/// are correlated with each other:
///
///   l(x) = -1/2 (sum_j e_j' S_j^-1 e_j + w' (I - sum_j V_j' S_j^-1 V_j)^-1 w),   w = sum_j V_j' S_j^-1 e_j,
///
/// with e_j = z_j - h(x, l_j) - V_j y, y = L^-1 xi, V_j = J_j C_j L^-T, P = L L', J_j = dh / dl_j at the
/// prior mean. The cap applies as above; w sums over the landmarks below it.
class PoseLikelihood {
 public:
  /// For landmarks whose errors are independent of the prior's.
  PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap);

  /// For landmarks whose errors are correlated with the prior's, by Landmark::pose_cross_covariance.
  PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap, const PoseGaussian& prior);

  /// Batched over the columns [q; p] of `poses` (T_keyframe_camera).
  template <int Count>
  void operator()(const antipode::Matrix<double, 8, Count>& poses,
                  antipode::Vector<double, Count>& values) const {
    for (int k = 0; k < Count; ++k) values[k] = evaluate(poses.col(k));
  }

  /// Sum of the capped squared Mahalanobis distances at one pose.
  [[nodiscard]] double squared_distance(const Pose& T_keyframe_camera) const {
    return -2.0 * evaluate(T_keyframe_camera.coeffs());
  }

  /// Number of scalar measurements.
  [[nodiscard]] int dimension() const noexcept { return 3 * static_cast<int>(count_); }

 private:
  /// U of a match: S^-1 = U' U.
  [[nodiscard]] Matrix3<double> whitening(std::size_t landmark) const;
  [[nodiscard]] double evaluate(const antipode::Vector8<double>& pose) const;

  StereoCamera camera_;
  double cap_;
  std::size_t count_;  // of landmarks
  std::vector<LandmarkBlock> blocks_;

  bool correlated_ = false;
  Pose prior_ = Pose::identity();
  Matrix6<double> prior_whitening_ = Matrix6<double>::Identity();  // L^-1
  Matrix6<double> shared_ = Matrix6<double>::Zero();               // (I - sum V' S^-1 V)^-1
};

}  // namespace stereo_slam
