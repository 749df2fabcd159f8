// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/output.hpp"

namespace stereo_slam {

/// Whose poses a run writes. kCamera: the rectified left camera, relative to where it began. kBody: the body
/// that the recording's calibration speaks of (EuRoC: the IMU), relative to where it began.
enum class PoseFrame { kCamera, kBody };

/// T_body_camera of a sequence. Throws std::runtime_error when its calibration does not tell.
[[nodiscard]] Eigen::Isometry3d require_body(const StereoSequence& sequence);

/// The record of a camera's run as that of the body it is fixed to: with X = T_body_camera a pose T becomes X
/// T X^-1, the covariance of its right perturbation Ad(X) P Ad(X)', a point of the map X p.
[[nodiscard]] RunRecord in_body_frame(RunRecord record, const Eigen::Isometry3d& T_body_camera);

}  // namespace stereo_slam
