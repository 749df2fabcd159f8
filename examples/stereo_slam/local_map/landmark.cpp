// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/landmark.hpp"

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
  const Vector3<double> h = in_camera(point, T_keyframe_camera);
  if (!(h.z() > StereoCamera::kMinDepth_m * point.w) || !(h.z() > 0.0)) return std::nullopt;
  return StereoPoint(camera.fx * h.x() / h.z() + camera.cx, camera.fy * h.y() / h.z() + camera.cy,
                     camera.fx * camera.baseline_m * point.w / h.z());
}

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

std::vector<LandmarkTrack> tracks_in_view(const MapView& map, const Pose& T_keyframe_camera,
                                          std::size_t frame) {
  std::vector<LandmarkTrack> tracks;
  for (const Landmark& landmark : map.landmarks) {
    const auto z = project(to_point(landmark, landmark.mean, map.camera), T_keyframe_camera, map.camera);
    if (!z || !(z->z() > 0.0) || !map.camera.in_view(*z)) continue;
    const bool found = landmark.last_seen == frame;
    tracks.push_back({.id = landmark.id,
                      .left_px = found ? landmark.last_px : Vector2<double>(z->head<2>()),
                      .depth_m = map.camera.fx * map.camera.baseline_m / z->z(),
                      .observations = landmark.observations,
                      .found = found});
  }
  return tracks;
}

}  // namespace stereo_slam
