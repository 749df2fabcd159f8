// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/core/types.hpp"

/// Geometry of poses and covariances for the pages.
namespace stereo_slam::report {

/// Path length from the first pose to each, in m.
[[nodiscard]] std::vector<double> path_lengths(std::span<const PoseGaussian> trajectory);

/// Speed from the previous pose to each, in m/s; the first has that of the second. NaN for a single pose and
/// where time stands still.
[[nodiscard]] std::vector<double> speeds(std::span<const PoseGaussian> trajectory,
                                         std::span<const std::int64_t> stamps_ns);

/// Covariance of a position in world axes, m2.
[[nodiscard]] Matrix3<double> position_covariance(const PoseGaussian& T_world_camera);

/// One standard deviation of a position.
struct SigmaEllipsoid {
  Vector3<double> half_axes_m;           ///< the shortest first
  Eigen::Quaterniond R_world_ellipsoid;  ///< its axes in the world
};

[[nodiscard]] SigmaEllipsoid sigma_ellipsoid(const PoseGaussian& T_world_camera);

}  // namespace stereo_slam::report
