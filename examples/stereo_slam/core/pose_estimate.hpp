// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_algebra.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The filter's density of a pose: orientation and translation coupled, valid for wide orientations too.
using PoseDensity = antipode::BinghamGaussian<double>;

/// Pose of a keyframe relative to itself: the identity with a negligible covariance, since a density cannot
/// have a covariance of zero.
[[nodiscard]] PoseDensity certain_pose();

/// Limit of the relative errors and angles that a calibration may leave: more is no calibration.
inline constexpr double kLargestCalibrationError = 0.5;

/// Standard deviation of the rotation drift, rad per frame, if the image motion between two frames has a
/// constant error of `drift_px`. At most kLargestCalibrationError.
[[nodiscard]] double drift_sigma_rad(double drift_px, const StereoCamera& camera);

/// A pose and its sensitivity to drift. The drift is an unknown constant rotation, in the camera's axes, that
/// is added to the motion from each frame to the next.
///
/// Approximation: the drift between two keyframes changes only the orientation. All rotations since the first
/// keyframe are applied at the second one.
struct DriftingPose {
  PoseGaussian estimate;                  ///< without the uncertainty due to drift
  Matrix6x3 J_drift = Matrix6x3::Zero();  ///< d (right perturbation of the pose) / d (rotation per frame)

  /// The estimate including the uncertainty due to a drift with a standard deviation of `sigma_rad` per
  /// frame.
  [[nodiscard]] PoseGaussian with_drift(double sigma_rad) const;
};

/// T_a_c from T_a_b and T_b_c. Frame c is `frames` frames after b, or before b if `frames` is negative.
[[nodiscard]] DriftingPose compose(const DriftingPose& T_a_b, const PoseGaussian& T_b_c, double frames);

/// The estimate with the uncertainty of `error.scale_sigma` and `error.axes_sigma_rad` added. All frames
/// share the calibration errors, and no measurement of the camera observes them. They are therefore no part
/// of the state, and are added once, to the reported pose. An error of the baseline scales all lengths: the
/// translation is uncertain along its own direction. An error of the principal point rotates the camera's
/// axes by a rotation X: the estimate is X T X^-1 instead of T, so that the direction of travel is uncertain.
[[nodiscard]] PoseGaussian with_calibration_error(const PoseGaussian& T_a_b, const CalibrationError& error);

}  // namespace stereo_slam
