// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// A point measured in two stereo frames, linearised at the motion between them.
struct TwoFramePoint {
  Vector3<double> innovation;          ///< second measurement minus its prediction from the first
  Matrix3<double> S_inverse;           ///< information of the innovation
  Eigen::Matrix<double, 3, 6> J_pose;  ///< d prediction / d motion
  Matrix3<double> J_first;             ///< d prediction / d first measurement
  StereoPoint first, second;           ///< most likely, given both: the noise of what was measured would be
                                       ///< correlated with that of the innovation
  /// Of a delay of the right images: d prediction minus d second measurement, px/s.
  Vector3<double> by_delay = Vector3<double>::Zero();
};

/// A motion between two stereo frames, and the points that were measured in both.
struct SeenMotion {
  Pose T_first_second;
  std::vector<TwoFramePoint> points;
};

}  // namespace stereo_slam
