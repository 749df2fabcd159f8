// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Parametrisation of a landmark.
enum class LandmarkForm {
  kEuclidean,     ///< (X, Y, Z) in the reference frame, m
  kInverseDepth,  ///< (u, v, d) in the camera that observed it first, px: Gaussian there, and finite for
                  ///< points at infinity
};

/// Point x / w of the reference frame; w = 0 is a direction.
using HomogeneousPoint = antipode::HomogeneousPoint<double>;

/// A point of the map, relative to the reference keyframe's camera (eq. 10).
struct Landmark {
  std::uint32_t id = 0;  ///< stays the same over keyframes while it is matched
  LandmarkForm form = LandmarkForm::kEuclidean;
  Vector3<double> mean;
  Matrix3<double> covariance;
  Matrix6x3 pose_cross_covariance = Matrix6x3::Zero();  ///< of the current pose's error and the mean's: the
                                                        ///< mean's error entered all updates of the pose
  Pose T_reference_anchor = Pose::identity();           ///< camera that observed it first
  Vector2<double> anchor_px;                            ///< its position in that camera's left image
  Vector2<double> disparity_slope = Vector2<double>::Zero();  ///< d disparity / d (u, v) there
  Descriptor descriptor{};
  Vector2<double> last_px;    ///< last observation, left image
  std::size_t last_seen = 0;  ///< frame of that observation
  int observations = 1;
  std::uint8_t intensity = 0;
};

/// Landmarks relative to the reference keyframe, and the camera that observes them.
struct MapView {
  const std::vector<Landmark>& landmarks;
  const StereoCamera& camera;
};

/// Point of the reference frame for parameters `l` of the landmark: its mean, or a sample.
[[nodiscard]] HomogeneousPoint to_point(const Landmark& landmark, const Vector3<double>& l,
                                        const StereoCamera& camera);

/// d (x, w) / d l at the mean: four rows.
[[nodiscard]] Eigen::Matrix<double, 4, 3> point_jacobian(const Landmark& landmark,
                                                         const StereoCamera& camera);

/// Stereo measurement of a homogeneous point at a camera pose; nothing when it is not in front of the camera.
[[nodiscard]] std::optional<StereoPoint> project(const HomogeneousPoint& point,
                                                 const Pose& T_reference_camera, const StereoCamera& camera);

}  // namespace stereo_slam
