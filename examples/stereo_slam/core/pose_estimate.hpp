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

/// Standard deviations of the six components of an error with this covariance.
[[nodiscard]] Vector6<double> standard_deviations(const Matrix6<double>& covariance);

/// A pose that is composed of links, and its sensitivity to the common error of the links.
///
/// A link is a measured motion: from one keyframe to the next, or from a keyframe to a frame. Its error has a
/// part of its own, and a part that all links have in common: each of its six components, in the camera's
/// axes, is the same multiple of the link's own standard deviation in all links. These six multiples are
/// unknown. Errors of single links add up with the square root of their number, the common error with the
/// number itself.
struct LinkedPose {
  PoseGaussian estimate;                               ///< without the uncertainty due to the common error
  Matrix6<double> J_common = Matrix6<double>::Zero();  ///< d (right perturbation) / d (the six multiples)

  /// The estimate including the uncertainty due to the common error. `ratio` is the standard deviation of the
  /// six multiples.
  [[nodiscard]] PoseGaussian with_common_error(double ratio) const;
};

/// T_a_c from T_a_b and the link T_b_c. A link that was not measured, only predicted, has no part in the
/// common error.
[[nodiscard]] LinkedPose compose(const LinkedPose& T_a_b, const PoseGaussian& T_b_c, bool measured = true);

/// The estimate with the uncertainty of `error.scale_sigma` and `error.axes_sigma_rad` added. All frames
/// share the calibration errors, and no measurement of the camera observes them. They are therefore no part
/// of the state, and are added once, to the reported pose. An error of the baseline scales all lengths: the
/// translation is uncertain along its own direction. An error of the principal point rotates the camera's
/// axes by a rotation X: the estimate is X T X^-1 instead of T, so that the direction of travel is uncertain.
[[nodiscard]] PoseGaussian with_calibration_error(const PoseGaussian& T_a_b, const CalibrationError& error);

}  // namespace stereo_slam
