// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/odometry/motion_estimation.hpp"
#include "stereo_slam/odometry/point_tracks.hpp"
#include "stereo_slam/odometry/two_view_adjustment.hpp"
#include "stereo_slam/rig/right_image_fit.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Frame-to-frame stereo odometry: the system input u_k of the filter (eq. 11).
struct OdometryResult {
  bool valid = false;
  PoseGaussian T_previous_current;
  std::vector<StereoCorrespondence> inliers;  ///< the points that give the motion
  bool surprising = false;                    ///< the motion is far from the expected one
  RightImageFit right_image;  ///< of the points followed; without points if by circular matching
  std::size_t points = 0;     ///< of the previous frame that were to be followed; 0 if by circular matching

  /// Whether fewer than half of the points of the previous frame show this motion, or there is none.
  [[nodiscard]] bool of_minority() const { return !valid || 2 * inliers.size() < points; }
  /// Whether a tenth or more of the points that were followed do not show this motion, or there is none. On a
  /// lorry 20 % and more do not, without vehicles 3 %.
  [[nodiscard]] bool contradicted() const {
    return !valid || 10 * inliers.size() <= 9 * right_image.in_right;
  }
};

/// Points of the previous frame, as measured there, that circular matching starts from.
struct OdometryPoints {
  std::vector<StereoPoint> points;         ///< the motion is estimated from them
  std::vector<StereoPoint> static_points;  ///< landmarks matched there; they only help to find the inliers
};

/// Points from which circular matching starts in the next frame: features of this frame with a stereo match,
/// spread over buckets, at least settings.odometry.exclusion_px from `reserved_px` (features of landmarks).
[[nodiscard]] std::vector<StereoPoint> select_odometry_points(const StereoView& view,
                                                              const std::vector<Feature>& features,
                                                              const std::vector<Vector2<double>>& reserved_px,
                                                              const Settings& settings);

/// Motion of the camera from the previous frame to the current one, `view`, by the paper's circular matching
/// (sec. IV-B): it follows the points from the previous left image to the current left, the current right,
/// the previous right and back to the previous left image. Points that return to where they started give the
/// motion. The static points vote on which points are inliers, so that a large moving object does not win;
/// they have no other weight. The search starts from `expected`. The random numbers depend on settings.seed
/// and the frame's index only.
[[nodiscard]] OdometryResult odometry_from_circle(const ConsecutivePyramids& pyramids,
                                                  const OdometryPoints& points, const StereoView& view,
                                                  const ExpectedMotion& expected, const Settings& settings);

/// The same motion from points followed over many frames. If no motion is expected, the motion that shows
/// over the larger part of the image is chosen. `tracks` keeps the inliers only.
[[nodiscard]] OdometryResult odometry_from_tracks(PointTracks& tracks, const ConsecutivePyramids& pyramids,
                                                  const StereoView& view, const ExpectedMotion& expected,
                                                  const Settings& settings);

}  // namespace stereo_slam
