// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"

namespace stereo_slam {

/// Expected measurement of a landmark (Alg. 3).
struct PredictedLandmark {
  std::size_t index = 0;                ///< in the list of landmarks
  StereoPoint z = StereoPoint::Zero();  ///< expected measurement
  /// Covariance of z from the landmark, at the mean pose: Alg. 3 before R is added.
  Matrix3<double> landmark_part = Matrix3<double>::Zero();
  /// Covariance of z from the pose, needed for gating.
  Matrix3<double> pose_part = Matrix3<double>::Zero();
};

/// Expected measurements of the landmarks that are in view and nearer than `max_baselines` times the
/// baseline. The landmark's uncertainty is propagated by sigma points (Alg. 3), that of the pose by the
/// Jacobian.
[[nodiscard]] std::vector<PredictedLandmark> project_landmarks(const MapView& map,
                                                               const PoseGaussian& T_keyframe_camera,
                                                               double max_baselines);

/// d z / d xi of a homogeneous point under the right perturbation xi = (rotation, translation) of the camera
/// pose.
[[nodiscard]] Eigen::Matrix<double, 3, 6> pose_jacobian(const HomogeneousPoint& point,
                                                        const Pose& T_keyframe_camera,
                                                        const StereoCamera& camera);

/// d z / d l of a landmark at its mean.
[[nodiscard]] Matrix3<double> landmark_jacobian(const Landmark& landmark, const Pose& T_keyframe_camera,
                                                const StereoCamera& camera);

}  // namespace stereo_slam
