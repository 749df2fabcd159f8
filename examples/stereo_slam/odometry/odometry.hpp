// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Frame-to-frame stereo odometry: the system input u_k of the filter (eq. 11).
struct OdometryResult {
  bool valid = false;
  PoseGaussian T_previous_current;
  int tracked = 0;                          ///< points that closed the circle
  std::vector<Vector2<double>> inliers_px;  ///< where the inliers are in the current left image
};

/// Points of a frame that the odometry of the next frame will start from: features with a stereo match,
/// spread over buckets, at least `settings.exclusion_px` from `reserved_px` (features that belong to
/// landmarks).
[[nodiscard]] std::vector<StereoPoint> select_odometry_points(const std::vector<Feature>& features,
                                                              const std::vector<Vector2<double>>& reserved_px,
                                                              const StereoFrame& frame,
                                                              const RectificationResidual& rectification,
                                                              const Settings& settings);

/// Follows the points around the circle previous left, current left, current right, previous right, previous
/// left, and estimates the motion from those that come back to where they started. `static_points`, those
/// that the filter has matched in the previous frame, do not enter the estimate, but help to tell the world
/// from what moves in it. `predicted` starts the search.
[[nodiscard]] OdometryResult estimate_odometry(const StereoPyramid& previous,
                                               const std::vector<StereoPoint>& points,
                                               const std::vector<StereoPoint>& static_points,
                                               const StereoPyramid& current, const StereoCamera& camera,
                                               const RectificationResidual& rectification,
                                               const Pose& predicted_T_previous_current, std::uint64_t seed,
                                               const OdometrySettings& settings);

}  // namespace stereo_slam
