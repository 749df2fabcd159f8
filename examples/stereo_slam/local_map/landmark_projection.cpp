// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/landmark_projection.hpp"

#include <antipode/distributions/gaussian.hpp>
#include <antipode/filters/unscented_update.hpp>
#include <antipode/geometry/quaternion.hpp>

namespace stereo_slam {
namespace {

/// Position of the point in camera coordinates, times w.
[[nodiscard]] Vector3<double> in_camera(const HomogeneousPoint& point, const Pose& T_keyframe_camera) {
  return antipode::rotate(antipode::conjugate(T_keyframe_camera.rotation()),
                          Vector3<double>(point.x - T_keyframe_camera.translation() * point.w));
}

/// d z / d (h, w) of z = (fx h_x/h_z + cx, fy h_y/h_z + cy, fx b w/h_z).
[[nodiscard]] Eigen::Matrix<double, 3, 4> homogeneous_jacobian(const Vector3<double>& h, double w,
                                                               const StereoCamera& camera) {
  const double inverse = 1.0 / h.z();
  const double bf = camera.fx * camera.baseline_m;
  Eigen::Matrix<double, 3, 4> J;
  J << camera.fx * inverse, 0.0, -camera.fx * h.x() * inverse * inverse, 0.0,  //
      0.0, camera.fy * inverse, -camera.fy * h.y() * inverse * inverse, 0.0,   //
      0.0, 0.0, -bf * w * inverse * inverse, bf * inverse;
  return J;
}

}  // namespace

std::vector<PredictedLandmark> project_landmarks(const MapView& map, const PoseGaussian& T_keyframe_camera,
                                                 double max_baselines) {
  const std::vector<Landmark>& landmarks = map.landmarks;
  const StereoCamera& camera = map.camera;
  const double min_disparity_px = camera.fx / max_baselines;
  std::vector<PredictedLandmark> predicted;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const HomogeneousPoint point = to_point(landmarks[i], landmarks[i].mean, camera);
    const auto centre = project(point, T_keyframe_camera.pose, camera);
    if (!centre || !camera.in_view(*centre) || centre->z() < min_disparity_px) continue;
    const antipode::Gaussian<double, 3> landmark(landmarks[i].mean, landmarks[i].covariance);
    const auto gaussian = antipode::project_gaussian(
        landmark, T_keyframe_camera.pose, [&](const Pose& pose, const Vector3<double>& l) {
          return project(to_point(landmarks[i], l, camera), pose, camera);
        });
    if (!gaussian) continue;
    const Eigen::Matrix<double, 3, 6> J = pose_jacobian(point, T_keyframe_camera.pose, camera);
    predicted.push_back(
        {i, gaussian->mean, gaussian->covariance, J * T_keyframe_camera.covariance * J.transpose()});
  }
  return predicted;
}

Eigen::Matrix<double, 3, 6> pose_jacobian(const HomogeneousPoint& point, const Pose& T_keyframe_camera,
                                          const StereoCamera& camera) {
  const Vector3<double> h = in_camera(point, T_keyframe_camera);
  const Eigen::Matrix<double, 3, 4> J = homogeneous_jacobian(h, point.w, camera);
  Eigen::Matrix<double, 3, 6> result;
  result.leftCols<3>() = J.leftCols<3>() * antipode::skew(h);
  result.rightCols<3>() = -point.w * J.leftCols<3>();
  return result;
}

Matrix3<double> landmark_jacobian(const Landmark& landmark, const Pose& T_keyframe_camera,
                                  const StereoCamera& camera) {
  const HomogeneousPoint point = to_point(landmark, landmark.mean, camera);
  const Eigen::Matrix<double, 4, 3> J_point = point_jacobian(landmark, camera);
  const Matrix3<double> R_camera_reference = T_keyframe_camera.rotation_matrix().transpose();
  Eigen::Matrix<double, 4, 3> J_camera;  // d (h, w) / d l
  J_camera.topRows<3>() =
      R_camera_reference * (J_point.topRows<3>() - T_keyframe_camera.translation() * J_point.row(3));
  J_camera.row(3) = J_point.row(3);
  return homogeneous_jacobian(in_camera(point, T_keyframe_camera), point.w, camera) * J_camera;
}

}  // namespace stereo_slam
