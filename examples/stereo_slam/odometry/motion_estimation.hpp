// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/odometry/expected_motion.hpp"
#include "stereo_slam/odometry/two_view_adjustment.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Motion between two stereo frames.
struct MotionEstimate {
  bool valid = false;  ///< enough inliers and a well-posed solution
  PoseGaussian T_previous_current;
  std::vector<std::uint8_t> is_inlier;  ///< one flag per point
  int inlier_count = 0;
  bool surprising = false;  ///< the motion is far from the expected one
};

/// Which points agree with a motion, with the noise settings.pixel_sigma_px; one flag per point.
[[nodiscard]] std::vector<std::uint8_t> agreement(std::span<const StereoCorrespondence> points,
                                                  const StereoCamera& camera, const Pose& motion,
                                                  const OdometrySettings& settings);

/// Relative pose of two stereo frames.
///
/// RANSAC over three correspondences finds the inliers, with the noise settings.pixel_sigma_px for all
/// points. A two-view adjustment of the inliers, with each point's own noise, gives the motion. The
/// `static_points` help to choose the inliers and have no other weight.
///
/// The largest consistent set may be that of a moving lorry. RANSAC therefore finds the most probable motion:
/// that with the smallest sum of truncated squared distances, each times the point's static_evidence, and of
/// the squared distance from the expected motion, up to ExpectedMotion::kSurprise. The points of one vehicle
/// err together, so that each of them is no proof of its own: a square of a standard deviation of the
/// expected motion counts as much as an outlier. Where nothing is expected, the larger set wins.
[[nodiscard]] MotionEstimate estimate_motion(std::span<const StereoCorrespondence> points,
                                             const StereoCamera& camera, const ExpectedMotion& expected,
                                             const OdometrySettings& settings, std::mt19937_64& random,
                                             std::span<const StereoCorrespondence> static_points = {});

}  // namespace stereo_slam
