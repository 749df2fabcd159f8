// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// A point measured in both images of a frame.
struct StereoMeasurement {
  StereoPoint z;                  ///< as exact cameras would measure it
  Vector2<double> left_px;        ///< where the left image shows it
  double row_error_px = 0.0;      ///< left minus right row, corrected
  double disparity_per_px = 1.0;  ///< change of the disparity by a pixel along the row of the right image
  Vector2<double> disparity_slope = Vector2<double>::Zero();  ///< d disparity / d (u, v)
  Matrix3<double> covariance_px2 = Matrix3<double>::Zero();   ///< of z, if measured by patches; else zero
  // Of the two patches, if measured by match_stereo():
  double correlation = 0.0;
  bool on_common_surface = false;  ///< the slope is that of a road, a wall, or a surface facing the camera

  /// Covariance of z if that of (u, v, u - u_right) is `of_positions_px2`.
  [[nodiscard]] Matrix3<double> with_disparity(Matrix3<double> of_positions_px2) const {
    of_positions_px2.row(2) *= disparity_per_px;
    of_positions_px2.col(2) *= disparity_per_px;
    return of_positions_px2;
  }
};

}  // namespace stereo_slam
