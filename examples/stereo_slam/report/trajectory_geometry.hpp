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

/// Speed from the previous pose to each, in m/s; the first pose has the speed of the second. NaN for a single
/// pose, and where a stamp is not later than the one before.
[[nodiscard]] std::vector<double> speeds(std::span<const PoseGaussian> trajectory,
                                         std::span<const std::int64_t> stamps_ns);

/// Covariance of a position in world axes, m2.
[[nodiscard]] Matrix3<double> position_covariance(const PoseGaussian& T_world_camera);

/// The one-sigma ellipsoid of a position.
struct SigmaEllipsoid {
  Vector3<double> half_axes_m;           ///< the shortest first
  Eigen::Quaterniond R_world_ellipsoid;  ///< its axes in the world
};

[[nodiscard]] SigmaEllipsoid sigma_ellipsoid(const PoseGaussian& T_world_camera);

}  // namespace stereo_slam::report
