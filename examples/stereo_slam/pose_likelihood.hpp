// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <antipode/eigen_types.hpp>

#include "associate.hpp"
#include "camera/stereo_camera.hpp"
#include "landmark.hpp"
#include "types.hpp"

namespace stereo_slam {

/// Log-likelihood of camera poses given matched landmarks (eq. 13, without constants):
///
///   l(x) = -1/2 sum_j min( e_j' S_j^-1 e_j, cap ),   e_j = z_j - h(x, l_j)
///
/// Every pose projects every landmark anew; S_j (landmark and pixel noise) is frozen at the prior mean. A
/// landmark behind a sampled camera costs `cap`. Copies what it needs: arrays over the landmarks, walked once
/// a pose.
class PoseLikelihood {
 public:
  PoseLikelihood(std::span<const Match> matches, const std::vector<Landmark>& landmarks,
                 const StereoCamera& camera, double cap);

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

  [[nodiscard]] int dimension() const noexcept { return 3 * static_cast<int>(points_.cols()); }

 private:
  [[nodiscard]] double evaluate(const antipode::Vector8<double>& pose) const;

  StereoCamera camera_;
  double cap_;
  Eigen::Array<double, 4, Eigen::Dynamic, Eigen::RowMajor> points_;  // homogeneous, reference frame
  Eigen::Array<double, 3, Eigen::Dynamic, Eigen::RowMajor> measurements_;
  Eigen::Array<double, 6, Eigen::Dynamic, Eigen::RowMajor>
      whitening_;  // upper triangle U, S^-1 = U' U, by rows
};

}  // namespace stereo_slam
