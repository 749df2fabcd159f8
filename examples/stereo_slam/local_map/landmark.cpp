// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/landmark.hpp"

namespace stereo_slam {

HomogeneousPoint to_point(const Landmark& landmark, const Vector3<double>& l, const StereoCamera& camera) {
  if (landmark.form == LandmarkForm::kEuclidean) return {l, 1.0};
  const Vector3<double> ray((l.x() - camera.cx) / camera.fx, (l.y() - camera.cy) / camera.fy, 1.0);
  const double inverse_depth = l.z() / (camera.fx * camera.baseline_m);
  return {landmark.T_reference_anchor.rotation_matrix() * ray +
              landmark.T_reference_anchor.translation() * inverse_depth,
          inverse_depth};
}

Eigen::Matrix<double, 4, 3> point_jacobian(const Landmark& landmark, const StereoCamera& camera) {
  Eigen::Matrix<double, 4, 3> J = Eigen::Matrix<double, 4, 3>::Zero();
  if (landmark.form == LandmarkForm::kEuclidean) {
    J.topRows<3>().setIdentity();
    return J;
  }
  const Matrix3<double> R = landmark.T_reference_anchor.rotation_matrix();
  const double depth_scale = 1.0 / (camera.fx * camera.baseline_m);
  J.col(0).head<3>() = R.col(0) / camera.fx;
  J.col(1).head<3>() = R.col(1) / camera.fy;
  J.col(2).head<3>() = landmark.T_reference_anchor.translation() * depth_scale;
  J(3, 2) = depth_scale;
  return J;
}

std::optional<StereoPoint> project(const HomogeneousPoint& point, const Pose& T_keyframe_camera,
                                   const StereoCamera& camera) {
  const Vector3<double> h =
      antipode::rotate(antipode::conjugate(T_keyframe_camera.rotation()),
                       Vector3<double>(point.x - T_keyframe_camera.translation() * point.w));
  if (!(h.z() > StereoCamera::kMinDepth_m * point.w) || !(h.z() > 0.0)) return std::nullopt;
  return StereoPoint(camera.fx * h.x() / h.z() + camera.cx, camera.fy * h.y() / h.z() + camera.cy,
                     camera.fx * camera.baseline_m * point.w / h.z());
}

}  // namespace stereo_slam
