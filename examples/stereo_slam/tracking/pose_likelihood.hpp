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
/// Every pose projects every landmark anew; S_j (landmark and pixel noise) is frozen at the prior mean. A
/// landmark behind a sampled camera costs `cap`. It keeps its own copy of what it needs.
///
/// If the landmarks' errors are correlated with the prior's, C_j = Cov(l_j, xi), their expected errors at the
/// pose x = prior exp(xi) are C_j P^-1 xi. The remaining errors are correlated with each other:
///
///   l(x) = -1/2 (sum_j e_j' S_j^-1 e_j + w' (I - sum_j V_j' S_j^-1 V_j)^-1 w),   w = sum_j V_j' S_j^-1 e_j,
///
/// with e_j = z_j - h(x, l_j) - V_j y, y = L^-1 xi, V_j = J_j C_j L^-T, P = L L'.
class PoseLikelihood {
 public:
  PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap);

  /// With the correlation of the landmarks' errors and the prior's.
  PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap, const PoseGaussian& prior);

  /// Batched over the columns [q; p] of `poses` (T_reference_camera).
  template <int Count>
  void operator()(const antipode::Matrix<double, 8, Count>& poses,
                  antipode::Vector<double, Count>& values) const {
    for (int k = 0; k < Count; ++k) values[k] = evaluate(poses.col(k));
  }

  /// Sum of the capped squared Mahalanobis distances at one pose.
  [[nodiscard]] double squared_distance(const Pose& T_reference_camera) const {
    return -2.0 * evaluate(T_reference_camera.coeffs());
  }

  [[nodiscard]] int dimension() const noexcept { return 3 * static_cast<int>(count_); }

 private:
  /// U of a landmark.
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
