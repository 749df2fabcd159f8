// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/displacement_constraints.hpp"

#include <algorithm>

#include <Eigen/LU>

#include "stereo_slam/local_map/landmark_projection.hpp"

namespace stereo_slam {

std::vector<DisplacementConstraint> displacement_constraints(const std::vector<Match>& matches,
                                                             const MapView& map,
                                                             const RectificationResidual& rectification,
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
                               rectification.right_position(match.left_px, match.z.z()), camera)});
  }
  return constraints;
}

}  // namespace stereo_slam
