// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/rig/camera_errors.hpp"
#include "stereo_slam/rig/rectification_estimator.hpp"
#include "stereo_slam/rig/rectification_residual.hpp"
#include "stereo_slam/rig/seen_motion.hpp"

namespace stereo_slam {

/// How a motion depends on the errors of the cameras, and what its points show of them.
struct MotionEvidence {
  RectificationEffect::Derivative derivative;            ///< d motion / d coefficients
  RectificationEffect::Derivative derivative_by_second;  ///< if they change for the second frame alone
  Vector6<double> derivative_by_delay;                   ///< d motion / d delay of the right images, per s
  CameraErrors::Evidence evidence;                       ///< on the coefficients
  /// On the coefficients and a delay: both relative to those that the points were measured with.
  antipode::GaussianInformation<double, CameraErrors::kTerms + 1> with_delay;
};

/// The motion is eliminated, and so is a displacement of the second right image against the first if the rig
/// vibrates. `applied` are the coefficients that the points were measured with. Nothing if the points do not
/// determine the motion.
[[nodiscard]] std::optional<MotionEvidence> evidence_of_motion(std::span<const TwoFramePoint> points,
                                                               const RectificationResidual& residual,
                                                               const CameraErrors::Coefficients& applied,
                                                               const StereoCamera& camera, bool vibrates);

/// d motion / d parameters, if `by_parameters` is d prediction minus d second measurement of each point by
/// six parameters. Nothing if the points do not determine the motion.
[[nodiscard]] std::optional<Matrix6<double>> motion_by_parameters(
    std::span<const TwoFramePoint> points, std::span<const Eigen::Matrix<double, 3, 6>> by_parameters);

}  // namespace stereo_slam
