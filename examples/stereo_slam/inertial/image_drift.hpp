// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The drift of the images: an error that successive motions in them have in common. What causes it stays in
/// view for seconds: wrong distances of the points that are seen, and patches that change with the view.
///
/// It is proportional to the noise of a motion, per coordinate: with the standard deviation `kShare`, while
/// the rest of the noise is new in each motion. Over n motions it grows with n, and the rest with the root of
/// n, so both are equally large after 1 / kShare^2 motions. All poses and vectors are in the axes of the IMU.
class ImageDrift {
 public:
  /// Takes a motion that was measured, with its noise.
  void see(const PoseGaussian& T_previous_current) {
    of_motion_ = kShare * T_previous_current.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  }

  /// The drift of a motion, in rad and m, that has its standard deviation in each coordinate: that of the
  /// last motion that was measured. Zero before.
  [[nodiscard]] const Vector6<double>& of_motion() const noexcept { return of_motion_; }

  /// Makes the last frame the keyframe.
  void begin_keyframe() { since_keyframe_.setZero(); }

  /// Adds the drift of a motion to that since the keyframe.
  void move(const Pose& T_previous_current) {
    since_keyframe_ = (T_previous_current.inverse().adjoint() * since_keyframe_).eval();
    since_keyframe_.diagonal() += of_motion_;
  }

  /// The covariance of the drift of a pose relative to the keyframe, by that of the drift in standard
  /// deviations.
  [[nodiscard]] Matrix6<double> covariance(const Matrix6<double>& of_drift) const {
    return since_keyframe_ * of_drift * since_keyframe_.transpose();
  }

 private:
  /// Root mean square of the mean errors of the poses by landmarks over eight seconds, in standard deviations
  /// of the odometry's motion (docs/results/inertial.md).
  static constexpr double kShare = 0.1;

  Vector6<double> of_motion_ = Vector6<double>::Zero();
  Matrix6<double> since_keyframe_ =
      Matrix6<double>::Zero();  // the pose relative to the keyframe by the drift
};

}  // namespace stereo_slam
