// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"

/// @file
/// What matched landmarks say of the camera's pose x, in units of the errors' standard deviations.
///
/// The error of a landmark, e_j = z_j - h(x, l_j), has the covariance S_j of landmark and pixels, which is
/// that of the match and does not depend on x. The log-likelihood of a pose (eq. 13, without constants) is
///
///     l(x) = -1/2 sum_j e_j' S_j^-1 e_j.
///
/// Let the landmarks' errors be correlated with the prior's, C_j = Cov(l_j, xi), where the prior has the
/// covariance P. At the pose x = prior exp(xi) their expected errors are C_j P^-1 xi. The remaining errors
/// are correlated with each other:
///
///     l(x) = -1/2 (sum_j e_j' S_j^-1 e_j + w' (I - sum_j V_j' S_j^-1 V_j)^-1 w),   w = sum_j V_j' S_j^-1 e_j
///
/// with e_j = z_j - h(x, l_j) - V_j y, y = L^-1 xi, V_j = J_j C_j L^-T, P = L L', J_j = dh / dl_j at the
/// prior mean.
namespace stereo_slam {

/// One landmark and its measurement.
struct WhitenedMatch {
  HomogeneousPoint point;
  StereoPoint z;
  Matrix3<double> U;  ///< S^-1 = U' U
  antipode::Matrix<double, 3, 6> UV =
      antipode::Matrix<double, 3, 6>::Zero();  ///< the error shared with the prior
};

/// What the landmarks share with the prior.
struct SharedError {
  Pose prior;                   ///< its mean
  Matrix6<double> whitening;    ///< L^-1
  Matrix6<double> information;  ///< (I - sum V' S^-1 V)^-1
};

/// All landmarks that were matched.
struct WhitenedMatches {
  StereoCamera camera;
  std::vector<WhitenedMatch> matches;
  std::optional<SharedError> shared = {};  ///< nothing if their errors are independent of the prior's
};

/// For landmarks whose errors are independent of the prior's.
[[nodiscard]] WhitenedMatches whiten(std::span<const Match> matches, const MapView& map);

/// For landmarks whose errors are correlated with the prior's, by Landmark::pose_cross_covariance.
[[nodiscard]] WhitenedMatches whiten(std::span<const Match> matches, const MapView& map,
                                     const PoseGaussian& prior);

}  // namespace stereo_slam
