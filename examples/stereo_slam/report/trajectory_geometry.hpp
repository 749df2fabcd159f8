// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include "stereo_slam/core/types.hpp"

/// Geometry of poses and covariances for the charts.
namespace stereo_slam::report {

/// Path length from the first pose to each, in m.
[[nodiscard]] std::vector<double> path_lengths(std::span<const PoseGaussian> trajectory);

/// Covariance of a position in world axes, m2.
[[nodiscard]] Matrix3<double> position_covariance(const PoseGaussian& T_world_camera);

/// One standard deviation of a position in the plane of x and z.
struct SigmaEllipse {
  Vector2<double> half_axes_m;  ///< the longer first
  double angle_rad = 0.0;       ///< of the longer one, from x towards z
};

[[nodiscard]] SigmaEllipse sigma_ellipse(const PoseGaussian& T_world_camera);

}  // namespace stereo_slam::report
