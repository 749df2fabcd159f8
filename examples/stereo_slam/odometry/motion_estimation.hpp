// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/odometry/two_view_adjustment.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// What a motion is estimated from.
struct MotionCorrespondences {
  std::span<const StereoCorrespondence> points;  ///< the motion is fitted to the inliers among them
  std::span<const StereoCorrespondence>
      static_points{};  ///< known to be static; they vote on the inliers and have no other weight
};

/// How reliable an expected motion is.
enum class Expectation {
  kSteady,    ///< no jerk for some frames
  kNoMotion,  ///< no motion was measured before it
  kDoubtful,  ///< there was a jerk a few frames ago: the motion since then may be that relative to a vehicle
};

/// The motion that is expected between two frames.
struct ExpectedMotion {
  Pose T_previous_current;
  Expectation expectation = Expectation::kNoMotion;
};

/// Motion between two stereo frames.
struct MotionEstimate {
  bool valid = false;  ///< enough inliers and a well-posed solution
  PoseGaussian T_previous_current;
  std::vector<std::uint8_t> is_inlier;  ///< one flag per point
  int inlier_count = 0;
  bool jerk = false;  ///< the motion does not continue the expected one
};

/// Whether a motion continues the `expected` one. A larger change is a jerk, which no vehicle or hand makes
/// from one frame to the next.
[[nodiscard]] bool continues(const Pose& motion, const Pose& expected);

/// Which points agree with a motion, with the noise settings.pixel_sigma_px; one flag per point.
[[nodiscard]] std::vector<std::uint8_t> agreement(std::span<const StereoCorrespondence> points,
                                                  const StereoCamera& camera, const Pose& motion,
                                                  const OdometrySettings& settings);

/// Relative pose of two stereo frames.
///
/// RANSAC over three correspondences finds the inliers, with the noise settings.pixel_sigma_px for all
/// points. A two-view adjustment of the inliers, with each point's own noise, gives the motion.
///
/// Without static points the largest consistent set may be that of a moving lorry. A set that contradicts the
/// expected motion therefore needs four times the points of one that continues it, not counting those that
/// agree with both; against a steady motion also twice settings.min_inliers, since the lorry may hide nearly
/// all of the street. Against a doubtful motion a simple majority is enough.
[[nodiscard]] MotionEstimate estimate_motion(const MotionCorrespondences& correspondences,
                                             const StereoCamera& camera, const ExpectedMotion& expected,
                                             const OdometrySettings& settings, std::mt19937_64& random);

}  // namespace stereo_slam
