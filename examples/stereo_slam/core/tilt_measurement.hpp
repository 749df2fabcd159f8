// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// What gravity tells of the roll and pitch of a keyframe, relative to the first keyframe of the run.
///
/// The vertical has the direction v in the axes of the first camera, by definition, and u =
/// R_first_keyframe^T v in those of the keyframe. The measurement is u with independent errors: W u has the
/// covariance I. It says nothing of the heading. W may have rows of zeros, without information.
struct TiltMeasurement {
  Vector3<double> vertical_first = Vector3<double>::UnitY();                          ///< v, unit vector
  Vector3<double> vertical = Vector3<double>::UnitY();                                ///< u, unit vector
  antipode::Matrix<double, 2, 3> whitening = antipode::Matrix<double, 2, 3>::Zero();  ///< W, 1 / rad
};

/// W (R_first_keyframe^T v - u), and its derivative by the right perturbation of the rotation (2 x 3).
struct TiltResidual {
  Vector2<double> value;
  antipode::Matrix<double, 2, 3> jacobian;
};
[[nodiscard]] TiltResidual residual_of(const TiltMeasurement& tilt, const Pose& T_first_keyframe);

/// T_first_keyframe, corrected by the measurement: a Kalman update. The sensitivity to the common error
/// becomes less, too.
[[nodiscard]] LinkedPose with_tilt(const LinkedPose& T_first_keyframe, const TiltMeasurement& tilt);

/// The smallest turn of the keyframe, in its axes, after which the vertical is where it was measured.
[[nodiscard]] Pose levelling_turn(const Pose& T_first_keyframe, const TiltMeasurement& tilt);

/// The measurement of a vertical that is turned, in the keyframe's axes, with the keyframe.
[[nodiscard]] TiltMeasurement turned(const TiltMeasurement& tilt, const Vector3<double>& turn_rad);

/// As common_error_per_rad(), for a link to a keyframe whose tilt was measured: what the angles of the links
/// have in common turns the heading only. d (right perturbation) / d (the six factors, in rad).
[[nodiscard]] Matrix6<double> common_error_per_rad(const PoseGaussian& link, const TiltMeasurement& tilt);

/// As add_link() without a tilt. With one, T_first_c is also corrected by it; T_first_b is the other
/// argument.
[[nodiscard]] LinkedPose add_link(const LinkedPose& T_first_b, const PoseGaussian& T_b_c, bool measured,
                                  const std::optional<TiltMeasurement>& tilt);

/// By how much a keyframe is turned from where a path has it, as it is known from elsewhere. In the axes of
/// its camera, rad and rad^2.
struct KnownTurn {
  Vector3<double> mean = Vector3<double>::Zero();
  Matrix3<double> covariance = Matrix3<double>::Zero();
};

/// How a link was levelled.
struct Levelling {
  Vector3<double> turn = Vector3<double>::Zero();  ///< of the keyframe at its end, in its axes, rad
  double share_before = 0.0;  ///< of this turn that the keyframe at its beginning should have had, too
};

/// A link, and the tilt of the keyframe that it leads to.
struct LevelledLink {
  PoseGaussian T_previous_keyframe;
  std::optional<TiltMeasurement> tilt{};
  Levelling levelling{};
};

/// The link after which the composed pose has a tilt that is known from elsewhere, in mean and covariance.
///
/// Estimates of successive tilts have most of their errors in common, so they are no independent measurements
/// of the keyframes. Where the tilt is less certain than the composition has it, the covariance of the link
/// gets what is missing. Where it is more certain, the measurement gets the missing information, if that is
/// 5 % of the whole; else it waits for a later keyframe.
[[nodiscard]] LevelledLink level(const LinkedPose& T_first_previous, const PoseGaussian& link,
                                 const Vector3<double>& vertical_first, const KnownTurn& turn);

}  // namespace stereo_slam
