// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_algebra.hpp>

#include "stereo_slam/core/inertial_estimate.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The density of a pose in the DQV-SLAM paper, valid for wide orientations too.
using PoseDensity = antipode::BinghamGaussian<double>;

/// Pose of a keyframe relative to itself: the identity with a negligible covariance, since one of zero has no
/// inverse.
[[nodiscard]] PoseGaussian certain_pose();

/// Covariance of a pose of which nothing is known: a radian and a hundred metres.
[[nodiscard]] Matrix6<double> unknown_pose_covariance();

/// Limit of the relative errors and angles that a calibration may leave: more is no calibration.
inline constexpr double kLargestCalibrationError = 0.5;

/// The common error of a link (LinkedPose), if that of its angles has a root mean square of one radian: in
/// the proportion of the standard deviations of the link's own error. It is less for links that hardly
/// changed the view, and zero if the covariance has no angles.
[[nodiscard]] Vector6<double> common_error_per_rad(const PoseGaussian& link);

/// A pose that is composed of links, and its sensitivity to the common error of the links.
///
/// A link is the measured motion from one keyframe to the next. Its error has a part of its own, and a part
/// that all links have in common. The latter comes from errors of the images that are equally large in all
/// links, in pixels, and that more points do not average out. Its six components, in the camera's axes, are
/// six unknown factors times common_error_per_rad(). Errors of single links add up with the square root of
/// their number, the common error with the number itself.
struct LinkedPose {
  PoseGaussian estimate;  ///< without the uncertainty due to the common error
  /// d (right perturbation) / d (the six factors, in rad).
  Matrix6<double> J_common = Matrix6<double>::Zero();

  /// The estimate including the uncertainty due to the common error, which has this standard deviation in
  /// each link, as an angle.
  [[nodiscard]] PoseGaussian with_common_error(double sigma_rad) const;
};

/// T_a_c from T_a_b and the link T_b_c. A link that was not measured, only predicted, has no part in the
/// common error.
[[nodiscard]] LinkedPose add_link(const LinkedPose& T_a_b, const PoseGaussian& T_b_c, bool measured = true);

/// T_a_c from T_a_b and the motion of a frame from its keyframe. It has no part in the common error, because
/// the images have hardly changed yet.
[[nodiscard]] LinkedPose compose(const LinkedPose& T_a_b, const PoseGaussian& T_b_c);

/// The estimate with the uncertainty of `error.scale_sigma` and `error.axes_sigma_rad` added. All frames
/// share the calibration errors, and no measurement of the camera observes them. They are therefore no part
/// of the state, and are added once, to the reported pose. An error of the baseline scales all lengths: the
/// translation is uncertain along its own direction. An error of the principal point rotates the camera's
/// axes by a rotation X: the estimate is X T X^-1 instead of T, so that the direction of travel is uncertain.
[[nodiscard]] PoseGaussian with_calibration_error(const PoseGaussian& T_a_b, const CalibrationError& error);

/// The velocity with the same uncertainty: its length by the scale, and its direction by the camera's axes.
/// The images tell the velocity in units of the baseline, so it has the relative error of the path.
[[nodiscard]] InertialEstimate with_calibration_error(const InertialEstimate& estimate,
                                                      const CalibrationError& error);

}  // namespace stereo_slam
