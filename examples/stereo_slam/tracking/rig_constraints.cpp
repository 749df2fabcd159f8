// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/rig_constraints.hpp"

#include <algorithm>
#include <optional>

#include <Eigen/LU>

#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/local_map/landmark.hpp"

namespace stereo_slam {
namespace {

constexpr double kMinDisparity_px = 0.1;
constexpr int kIterations = 3;

/// A point measured as `first` in the keyframe and as `second`, with covariance `noise`, in the camera at
/// `T_keyframe_camera`. The error of the disparity in the keyframe affects both the prediction for the second
/// camera and the derivatives. Linearised at the measured disparity, the points would show biased errors of
/// the rig (errors in variables); therefore they are linearised at the most likely disparity given both
/// measurements.
[[nodiscard]] std::optional<TwoFramePoint> point_in_both(const StereoPoint& first, const StereoPoint& second,
                                                         const Matrix3<double>& noise,
                                                         const Pose& T_keyframe_camera,
                                                         const StereoCamera& camera) {
  const double variance = kKeyframeDisparitySigma_px * kKeyframeDisparitySigma_px;
  const Matrix3<double> R = kRigCaution * noise;
  const Pose T_camera_keyframe = T_keyframe_camera.inverse();
  StereoPoint likely = first;
  TwoFramePoint result;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const auto predicted = seen_by_second(likely, T_camera_keyframe, camera);
    if (!predicted) return std::nullopt;
    result.J_first = predicted->J_first;
    const Vector3<double> J = result.J_first.col(2);
    result.S_inverse = (R + variance * J * J.transpose()).inverse();
    result.innovation = second - predicted->z - J * (first.z() - likely.z());
    result.first = likely;
    result.second = predicted->z;
    if (iteration + 1 < kIterations) {
      const double step = variance * J.dot(result.S_inverse * result.innovation);
      likely.z() = std::max(first.z() + step, kMinDisparity_px);
    }
  }
  const HomogeneousPoint point{camera.back_project(likely)};
  result.J_pose = pose_jacobian(point, T_keyframe_camera, camera);
  return result;
}

}  // namespace

SeenMotion seen_motion(const std::vector<Match>& matches, const MapView& map, const Pose& T_keyframe_camera) {
  const StereoCamera& camera = map.camera;
  SeenMotion motion{T_keyframe_camera, {}};
  motion.points.reserve(matches.size());
  for (const auto& match : matches) {
    const StereoPoint& first = map.landmarks[match.landmark].mean;
    const auto point = point_in_both(first, match.z, match.R, T_keyframe_camera, camera);
    if (point) motion.points.push_back(*point);
  }
  return motion;
}

SeenMotion seen_motion(const std::vector<StereoCorrespondence>& points, const Pose& T_previous_current,
                       const StereoCamera& camera) {
  SeenMotion motion{T_previous_current, {}};
  motion.points.reserve(points.size());
  for (const auto& [previous, current, R, static_evidence] : points) {
    const Matrix3<double> noise = R.value_or(stereo_pixel_covariance(kKeyframeDisparitySigma_px));
    const auto point = point_in_both(previous, current, noise, T_previous_current, camera);
    if (point) motion.points.push_back(*point);
  }
  return motion;
}

std::vector<DisplacementConstraint> displacement_constraints(const std::vector<Match>& matches,
                                                             const MapView& map, const StereoView& view,
                                                             const Pose& T_keyframe_camera,
                                                             std::size_t most) {
  const StereoCamera& camera = map.camera;
  std::vector<DisplacementConstraint> constraints;
  const std::size_t count = std::min(most, matches.size());
  constraints.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Match& match = matches[i * matches.size() / count];
    const Landmark& landmark = map.landmarks[match.landmark];
    const HomogeneousPoint point = to_point(landmark, landmark.mean, camera);
    const auto expected = project(point, T_keyframe_camera, camera);
    if (!expected) continue;
    constraints.push_back({.innovation = match.z - *expected,
                           .S_inverse = (match.predicted.landmark_part + match.R).inverse(),
                           .J_pose = pose_jacobian(point, T_keyframe_camera, camera),
                           .row_error_px = match.row_error_px,
                           .basis = ImageDisplacement::basis(
                               view.geometry.right_position(match.left_px, match.z.z()), camera)});
  }
  return constraints;
}

}  // namespace stereo_slam
