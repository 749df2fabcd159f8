// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/inertial/inertial_state.hpp"

namespace stereo_slam {

/// The state at a frame, as it follows from the state at the frame before, together with the pose of the IMU
/// then. Poses are T_reference_imu.
struct InertialStep {
  InertialState state;
  Pose T_reference_previous = Pose::identity();
  Matrix6<double> previous = Matrix6<double>::Zero();  ///< covariance of T_reference_previous
  StateByPose cross = StateByPose::Zero();             ///< of the state with it

  /// The motion from the frame before.
  [[nodiscard]] Pose T_previous_current() const;
  /// How the error of the present pose depends on that of the one before: its regression, 6 x 6.
  [[nodiscard]] Matrix6<double> pose_regression() const;
};

/// The step of a state by the readings of an IMU.
[[nodiscard]] InertialStep step(const InertialState& previous, const ReadMotion& read);

/// A step with the motion that images measured, too.
struct FusedStep {
  InertialStep step;
  double nis = 0.0;  ///< normalised innovation squared of the motion, of 6 degrees of freedom
};

/// Corrects a step by the motion T_previous_current that the images show: a measurement of the pose relative
/// to that of the frame before, whose error is in both. Exact for small errors.
[[nodiscard]] FusedStep fuse(const InertialStep& step, const PoseGaussian& T_previous_current);

}  // namespace stereo_slam
