// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/odometry/motion_estimation.hpp"
#include "stereo_slam/rig/right_image_fit.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// A point that is followed from frame to frame.
struct TrackedPoint {
  StereoPoint z;                                              ///< in the last frame
  Vector2<double> left_px;                                    ///< where the last left image shows it
  Vector2<double> disparity_slope = Vector2<double>::Zero();  ///< d disparity / d (u, v)
  std::optional<Matrix3<double>> R;     ///< covariance of z, px^2; nothing for a new point
  std::optional<StereoPoint> previous;  ///< z in the frame before; nothing for a new point
  int static_frames = 0;                ///< so many frames on end it moved like the landmarks of the map
};

/// The points that the odometry measures the motion from. Each is followed for as long as it is seen.
class PointTracks {
 public:
  [[nodiscard]] const std::vector<TrackedPoint>& points() const noexcept { return points_; }

  /// Positions of the points in the last left image, px.
  [[nodiscard]] std::vector<Vector2<double>> positions() const;

  /// Follows the points into the current frame, `view`, and drops those that are lost. Optical flow finds a
  /// point in the left image; there the patch of the previous left image is aligned, and then the patch of
  /// the current left image in the right one, near the disparity that `predicted_T_previous_current` gives.
  /// Patches that do not correlate or violate the epipolar constraint are lost. Returns how well the right
  /// image fits the left one.
  RightImageFit follow(const ConsecutivePyramids& pyramids, const StereoView& view,
                       const Pose& predicted_T_previous_current, const OdometrySettings& settings);

  /// Drops the points whose flag is zero; one flag per point.
  void keep(const std::vector<std::uint8_t>& flags);

  /// Counts the frame for the points whose two measurements agree with the camera's motion
  /// `T_previous_current`, up to a pixel noise of `pixel_sigma_px`: they are static. The others begin anew,
  /// and without a motion all do.
  void compare_with(const std::optional<Pose>& T_previous_current, const StereoCamera& camera,
                    double pixel_sigma_px);

  /// Converts the last measurements, and drops points whose disparity is then not positive.
  void remeasure(const Remeasurement& change);

  /// Drops the points that are nearer than settings.odometry.exclusion_px to `reserved_px`. If few are left,
  /// adds corners with a stereo match where there is room.
  void replenish(const StereoView& view, const std::vector<Vector2<double>>& reserved_px,
                 const Settings& settings);

 private:
  std::vector<TrackedPoint> points_;
};

/// The two measurements of the points, one entry per point; all points must have two. Each frame in which a
/// point was static is evidence that it is.
[[nodiscard]] std::vector<StereoCorrespondence> correspondences(const std::vector<TrackedPoint>& points);

}  // namespace stereo_slam
