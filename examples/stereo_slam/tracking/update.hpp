// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Result of a pose update. Without convergence or enough matches the posterior is the prior.
template <class Density>
struct PoseUpdateOf {
  Density posterior;
  bool converged = false;  ///< the landmarks corrected the pose
  double nis = 0.0;  ///< normalised innovation squared: chi-square distributed if all noise is as assumed
  int nis_dof = 0;   ///< its degrees of freedom
  /// Factors on the posterior's variances, as the residuals show them: for the components that depend on u,
  /// and for those that depend on v (see NoiseScale). NaN if there are no residuals.
  Vector2<double> variance_ratio = Vector2<double>::Ones();
  std::vector<Match> used{};  ///< matches that the posterior rests on
};

using PoseUpdate = PoseUpdateOf<PoseGaussian>;

/// PoseUpdate::variance_ratio if the errors of the matches are normal and as large as assumed. It is 1 if all
/// matches have the same weight, and less otherwise, since weights are at most 1.
[[nodiscard]] double expected_variance_ratio(const UpdateSettings& settings);

/// Corrects the prior of a pose by the matched landmarks (eq. 13), with quadratic_update or, by the settings,
/// Alg. 2 and points of degree five.
[[nodiscard]] PoseUpdate update_pose(const PoseGaussian& prior, const std::vector<Match>& matches,
                                     const MapView& map, const UpdateSettings& settings);

/// The same by Alg. 2 on subsets of the matches, with orientation and translation independent (sec. IV-D).
[[nodiscard]] PoseUpdateOf<PoseDensity> update_as_in_paper(const PoseDensity& prior,
                                                           const std::vector<Match>& matches,
                                                           const MapView& map,
                                                           const UpdateSettings& settings);

}  // namespace stereo_slam
