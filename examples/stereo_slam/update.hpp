// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <antipode/distributions/bingham_gaussian.hpp>

#include "associate.hpp"
#include "camera/stereo_camera.hpp"
#include "landmark.hpp"
#include "settings.hpp"
#include "types.hpp"

namespace stereo_slam {

using PoseDensity = antipode::BinghamGaussian<double>;

struct PoseUpdate {
  PoseDensity posterior;
  bool converged = false;
  int steps = 0;
  double nis =
      0.0;  ///< normalised innovation squared, chi-square with `nis_dof` degrees if all noise is as assumed
  int nis_dof = 0;
  std::vector<Match> used{};  ///< the matches that made the posterior
};

/// Corrects the pose prior by the matched landmarks (eq. 13, Alg. 2, or the quadratic-surrogate progression).
[[nodiscard]] PoseUpdate update_pose(const PoseDensity& prior, const std::vector<Match>& matches,
                                     const std::vector<Landmark>& landmarks, const StereoCamera& camera,
                                     const UpdateSettings& settings);

/// Frames, or as much time as they take, without a measured motion.
struct UnseenSteps {
  double before = 0.0;  ///< the one at hand
  double now = 1.0;     ///< in the one at hand
};

/// Prior T_reference_camera of the current frame from the posterior of the last and the odometry (eq. 11).
/// Without a valid odometry the noise is that of the unseen steps. The paper's independent model drops the
/// correlation that the odometry's lever arm causes.
[[nodiscard]] PoseDensity predict_pose(const PoseDensity& posterior, const PoseEstimate& T_previous_current,
                                       bool odometry_valid, const Settings& settings,
                                       const UnseenSteps& unseen = {});

/// Mean and right-perturbation covariance of a density.
[[nodiscard]] PoseEstimate to_estimate(const PoseDensity& density);

/// T_a_c = T_a_b T_b_c of independent estimates, covariance to first order.
[[nodiscard]] PoseEstimate compose(const PoseEstimate& T_a_b, const PoseEstimate& T_b_c);

/// The estimate if the calibration is wrong by unknown amounts that all frames share. A wrong baseline scales
/// all lengths: the translation is uncertain along itself. A wrong principal point turns the camera's axes by
/// some X: what is estimated is X T X^-1, so that the direction of travel is uncertain. No measurement of the
/// camera tells either, so they are added to what is reported, once for the whole way, and are no part of the
/// state.
[[nodiscard]] PoseEstimate with_calibration_error(const PoseEstimate& T_a_b, const CalibrationError& error);

}  // namespace stereo_slam
