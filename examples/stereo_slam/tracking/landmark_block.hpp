// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Four matched landmarks, one per lane of a vector register. A lane without a landmark is zero except for
/// its weight, and adds nothing to the sums.
struct alignas(32) LandmarkBlock {
  static constexpr std::size_t kLanes = 4;
  using Lanes = std::array<double, kLanes>;

  std::array<Lanes, 3> point = {};         ///< weight times the position in the reference frame
  Lanes weight = {1.0, 1.0, 1.0, 1.0};     ///< w of HomogeneousPoint: 1, or an inverse depth (0 at infinity)
  std::array<Lanes, 3> measurement = {};   ///< (u, v, d), px
  std::array<Lanes, 6> whitening = {};     ///< U, upper triangle by rows: S^-1 = U' U
  std::array<Lanes, 18> correlation = {};  ///< U V by rows; see PoseLikelihood
  Lanes cap = {};  ///< cost of a landmark whose error exceeds the cap or that is behind the camera
};

/// The camera at a pose, and the largest cost of a landmark.
struct CameraAtPose {
  Matrix3<double> R_camera_reference;
  Vector3<double> t_camera_reference;
  StereoCamera camera;
  double cap;  ///< on squared Mahalanobis distances
};

/// Sums over landmarks of their errors e_j; see PoseLikelihood.
struct ErrorSums {
  double squared_distance = 0.0;                ///< sum_j min(e_j' S_j^-1 e_j, cap)
  Vector6<double> w = Vector6<double>::Zero();  ///< sum_j V_j' S_j^-1 e_j, of the landmarks below the cap
};

/// The squared distances of independent landmarks; w stays zero.
[[nodiscard]] ErrorSums sum_independent_errors(std::span<const LandmarkBlock> blocks,
                                               const CameraAtPose& view);

/// The sums over correlated landmarks: V_j y is subtracted from every error e_j first.
[[nodiscard]] ErrorSums sum_correlated_errors(std::span<const LandmarkBlock> blocks, const CameraAtPose& view,
                                              const Vector6<double>& y);

}  // namespace stereo_slam
