// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/frontend/plane_warp.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"

/// @file
/// The motion between two frames that the left images show: rough, but independent of the second right image.
namespace stereo_slam {

/// A point that is known in the previous frame, and where the left image of the current one shows it.
struct FollowedPoint {
  StereoPlane previous;
  Vector2<double> left_px;
};

/// At most 120 of the points, evenly chosen, followed by optical flow into the left image of `view`. Those
/// whose patches do not correlate there are left out.
[[nodiscard]] std::vector<FollowedPoint> follow_in_left(const std::vector<StereoPlane>& previous,
                                                        const ConsecutivePyramids& pyramids,
                                                        const StereoView& view,
                                                        const Pose& expected_T_previous_current,
                                                        const OdometrySettings& settings);

/// A motion, and which of the points agree with it.
struct AgreedMotion {
  static constexpr double kMaxError_px = 2.0;  ///< of a point that agrees

  Pose T_previous_current;
  std::vector<std::size_t> agreeing;
};

/// The motion between points of the previous frame and their positions in the current left image, px and
/// without the errors of the lens, by RANSAC. Nothing if they determine none.
[[nodiscard]] std::optional<AgreedMotion> motion_by_positions(const std::vector<StereoPoint>& previous,
                                                              const std::vector<Vector2<double>>& current_px,
                                                              const StereoCamera& camera);

/// The motion that points known in the previous frame show in the left image of `view`. Nothing if fewer than
/// 15 agree, or fewer than half of those that were found.
[[nodiscard]] std::optional<Pose> motion_in_left(const std::vector<StereoPlane>& previous,
                                                 const ConsecutivePyramids& pyramids, const StereoView& view,
                                                 const Pose& expected_T_previous_current,
                                                 const OdometrySettings& settings);

}  // namespace stereo_slam
