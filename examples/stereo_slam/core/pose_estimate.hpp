// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_algebra.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The filter's density of a pose: orientation and translation coupled, valid for wide orientations too.
using PoseDensity = antipode::BinghamGaussian<double>;

/// Pose of a keyframe relative to itself: known, up to the smallest covariance that densities represent.
[[nodiscard]] PoseDensity certain_pose();

/// Standard deviation of the drift, rad per frame, if the image motion between two frames has a constant
/// error of `drift_px`. At most 0.5: more is no calibration.
[[nodiscard]] double drift_sigma_rad(double drift_px, const StereoCamera& camera);

/// A pose, and what the drift does to it: the derivative of its right perturbation by a rotation that is
/// added to the motion from each frame to the next, the same in all of them, in the camera's axes. Between
/// two keyframes only the orientation drifts: the rotations since the keyframe count as one at their end.
struct DriftingPose {
  PoseGaussian estimate;  ///< without the drift's uncertainty
  Matrix6x3 drift = Matrix6x3::Zero();

  /// The estimate with the uncertainty by the drift, whose standard deviation is `sigma_rad` per frame.
  [[nodiscard]] PoseGaussian with_drift(double sigma_rad) const;
};

/// T_a_c from T_a_b and T_b_c, where c is `frames` frames after b; before b, if negative.
[[nodiscard]] DriftingPose compose(const DriftingPose& T_a_b, const PoseGaussian& T_b_c, double frames);

/// The estimate with the uncertainty of scale and axes added. All frames share the calibration's errors, and
/// no measurement of the camera observes them; they are therefore no part of the state, and are added once,
/// to the reported pose. An error of the baseline scales all lengths: the translation is uncertain along
/// itself. An error of the principal point turns the camera's axes by some X: the estimate is X T X^-1
/// instead of T, so that the direction of travel is uncertain.
[[nodiscard]] PoseGaussian with_calibration_error(const PoseGaussian& T_a_b, const CalibrationError& error);

}  // namespace stereo_slam
