// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

/// @file
/// The camera that fits the motion of points. A wrong focal length f stretches what a rectified stereo camera
/// measures along its axis, because (X, Y, Z) = b / d (u - cx, v - cy, f). A stretched world does not turn
/// like a rigid one, so that frames between which the camera turns show f, cx and cy. Straight motion does
/// not show them.
namespace stereo_slam {

/// A point seen in both images of one frame and in the left image of another, px.
struct MovedPoint {
  Eigen::Vector2d first_px;
  double disparity_px = 0.0;
  Eigen::Vector2d second_px;
  double rows_px = 0.0;  ///< row in the right image minus that in the left one
};

/// The points that two frames share. Some are wrong.
[[nodiscard]] std::vector<MovedPoint> moved_points(const StereoFrame& first, const StereoFrame& second);

/// A camera and how well it fits.
struct CameraFromMotion {
  double focal_factor = 1.0;  ///< its focal length in units of that of the calibration
  double sigma = 0.0;         ///< standard deviation of log(focal_factor)
  double gain =
      0.0;  ///< chi-square of the calibrated focal length, with any principal point, minus that of this
  bool is_camera = true;  ///< the principal point is in the image
  double spread = 0.0;  ///< by how much log(focal_factor) changes at most if one pair of frames is left out;
                        ///< zero if the camera explains the points

  /// Whether points move clearly not as with the calibrated focal length. That of good recordings is off by
  /// up to 2.5 %, by errors of their rectification, with gains of some hundreds; that of straight motion by
  /// any amount, with gains below 50.
  [[nodiscard]] bool is_surprising() const;

  /// Whether all pairs of frames show the same camera (spreads up to .015 with a wrong calibration). A moving
  /// picture in view and repeated images are another camera in each of them (.07 to 2).
  [[nodiscard]] bool is_one_camera() const;

  /// Whether the calibrated focal length is clearly wrong.
  [[nodiscard]] bool contradicts_calibration() const { return is_surprising() && is_one_camera(); }
};

/// The camera and the motions of all pairs of frames that fit the points best, from the calibrated camera on
/// (Gauss-Newton with Cauchy weights). Nothing if there are fewer than 100 points.
[[nodiscard]] std::optional<CameraFromMotion> camera_from_motion(
    const StereoCamera& camera, const std::vector<std::vector<MovedPoint>>& pairs);

}  // namespace stereo_slam
