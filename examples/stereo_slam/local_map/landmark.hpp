// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <antipode/sensors/inverse_depth_landmark.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Point x / w of the reference frame, m; with w = 0, x is the direction of a point at infinity.
using HomogeneousPoint = antipode::HomogeneousPoint<double>;

/// A point of the map, relative to the reference keyframe's camera (eq. 10): the measurement (u, v, d) of the
/// camera that observed it first, whose noise is Gaussian at any distance.
struct Landmark : antipode::InverseDepthLandmark<double> {
  std::uint32_t id = 0;                                 ///< stays the same over keyframes while it is matched
  Matrix6x3 pose_cross_covariance = Matrix6x3::Zero();  ///< of the pose's error with the mean's,
                                                        ///< which entered all updates of the pose
  Vector2<double> anchor_px;                            ///< its position in that camera's left image
  Vector2<double> disparity_slope = Vector2<double>::Zero();  ///< d disparity / d (u, v) there
  Descriptor descriptor{};
  Vector2<double> last_px;     ///< last observation, left image
  std::size_t last_seen = 0;   ///< frame of that observation
  int observations = 1;        ///< frames in which it was observed
  std::uint8_t intensity = 0;  ///< grey value at `anchor_px`
};

/// Landmarks relative to the reference keyframe, and the camera that observes them.
struct MapView {
  const std::vector<Landmark>& landmarks;
  const StereoCamera& camera;
};

/// Point in the reference frame for the parameters `l` of the landmark, (u, v, d) in px: its mean, or a
/// sample.
[[nodiscard]] HomogeneousPoint to_point(const Landmark& landmark, const Vector3<double>& l,
                                        const StereoCamera& camera);

/// Stereo measurement of a homogeneous point at a camera pose; nothing when it is not in front of the camera.
[[nodiscard]] std::optional<StereoPoint> project(const HomogeneousPoint& point, const Pose& T_keyframe_camera,
                                                 const StereoCamera& camera);

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

/// The landmarks that are in view of the left and the right image at a pose, and whether they were found in
/// `frame`, the last one.
[[nodiscard]] std::vector<LandmarkTrack> tracks_in_view(const MapView& map, const Pose& T_keyframe_camera,
                                                        std::size_t frame);

}  // namespace stereo_slam
