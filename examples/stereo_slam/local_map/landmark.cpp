// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/landmark.hpp"

#include <antipode/distributions/gaussian.hpp>
#include <antipode/filters/unscented_update.hpp>

namespace stereo_slam {
HomogeneousPoint to_point(const Landmark& landmark, const Vector3<double>& l, const StereoCamera& camera) {
  return landmark.point(camera.homogeneous(), l);
}

std::optional<StereoPoint> project(const HomogeneousPoint& point, const Pose& T_keyframe_camera,
                                   const StereoCamera& camera) {
  return camera.homogeneous().project(T_keyframe_camera, point);
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
  return camera.homogeneous().projection_jacobians(T_keyframe_camera, point).pose;
}

Matrix3<double> landmark_jacobian(const Landmark& landmark, const Pose& T_keyframe_camera,
                                  const StereoCamera& camera) {
  const auto stereo = camera.homogeneous();
  const HomogeneousPoint point = landmark.point(stereo, landmark.mean);
  return stereo.projection_jacobians(T_keyframe_camera, point).point * landmark.point_jacobian(stereo);
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
