// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/rectification_constraints.hpp"

#include <Eigen/LU>

#include "stereo_slam/local_map/landmark_projection.hpp"

namespace stereo_slam {
namespace {

/// d (u, v, d) in the camera at `T_keyframe_camera` / d disparity in the keyframe.
[[nodiscard]] Vector3<double> disparity_jacobian(const StereoPoint& z, const Pose& T_keyframe_camera,
                                                 const StereoCamera& camera) {
  const Vector3<double> p_camera = T_keyframe_camera.inverse() * camera.back_project(z);
  return camera.projection_jacobian(p_camera) * T_keyframe_camera.rotation_matrix().transpose() *
         camera.back_projection_jacobian(z).col(2);
}

}  // namespace

std::vector<BiasConstraint> bias_constraints(const std::vector<Match>& matches, const MapView& map,
                                             const Pose& T_keyframe_camera) {
  const StereoCamera& camera = map.camera;
  std::vector<BiasConstraint> constraints;
  for (const auto& match : matches) {
    const Landmark& landmark = map.landmarks[match.landmark];
    const HomogeneousPoint point = to_point(landmark, landmark.mean, camera);
    const auto first = project(point, Pose::identity(), camera);
    const auto second = project(point, T_keyframe_camera, camera);
    if (!first || !second) continue;
    const Matrix3<double> S = match.predicted.landmark_part + match.R;
    constraints.push_back({match.z - *second, S.inverse(), pose_jacobian(point, T_keyframe_camera, camera),
                           disparity_jacobian(*first, T_keyframe_camera, camera), first->head<2>(),
                           match.z.head<2>()});
  }
  return constraints;
}

}  // namespace stereo_slam
