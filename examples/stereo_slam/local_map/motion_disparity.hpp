// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include <Eigen/Core>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Position of a point in a left image, as an exact pinhole camera sees it.
struct LeftPosition {
  Vector2<double> px;
  Matrix2<double> covariance_px2;
};

/// Disparity of a point in the second of two frames, of which only the left images show it: its depth by the
/// motion between them, in the unit in which the stereo camera measures it.
struct MotionDisparity {
  double px = 0.0;            ///< at most zero for a point that seems to be behind the cameras or at infinity
  double variance_px2 = 0.0;  ///< due to the noise of the two positions
  Eigen::Matrix<double, 1, 6> by_motion = Eigen::Matrix<double, 1, 6>::Zero();  ///< d disparity / d motion,
                                                                                ///< perturbed on the right
  Eigen::RowVector2d by_first = Eigen::RowVector2d::Zero();   ///< d disparity / d first position
  Eigen::RowVector2d by_second = Eigen::RowVector2d::Zero();  ///< d disparity / d second position
  double squared_distance = 0.0;  ///< Mahalanobis, of the first position from the epipolar line; one degree
                                  ///< of freedom
};

/// Triangulates a point by least squares over its position in the first image. Nothing if the motion does not
/// tell its depth: the point lies in the direction of motion, or the camera did not move.
[[nodiscard]] std::optional<MotionDisparity> disparity_by_motion(const LeftPosition& first,
                                                                 const LeftPosition& second,
                                                                 const PoseGaussian& T_first_second,
                                                                 const StereoCamera& camera);

}  // namespace stereo_slam
