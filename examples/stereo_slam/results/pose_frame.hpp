// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/output.hpp"

namespace stereo_slam {

/// Frame whose poses a run writes, each relative to its first pose. kCamera: the rectified left camera.
/// kBody: the body of the recording's calibration (EuRoC: the IMU).
enum class PoseFrame { kCamera, kBody };

/// T_body_camera of a sequence. Throws std::runtime_error when its calibration does not contain it.
[[nodiscard]] Eigen::Isometry3d require_body(const StereoSequence& sequence);

/// Converts the record of a camera to that of the body it is fixed to. With X = T_body_camera, a pose T
/// becomes X T X^-1, the covariance P of its right perturbation Ad(X) P Ad(X)', a map point p becomes X p.
[[nodiscard]] RunRecord in_body_frame(RunRecord record, const Eigen::Isometry3d& T_body_camera);
[[nodiscard]] PoseGaussian in_body_frame(PoseGaussian pose, const Eigen::Isometry3d& T_body_camera);
[[nodiscard]] FrameResult in_body_frame(FrameResult result, const Eigen::Isometry3d& T_body_camera);
[[nodiscard]] LoopEvent in_body_frame(LoopEvent loop, const Eigen::Isometry3d& T_body_camera);

}  // namespace stereo_slam
