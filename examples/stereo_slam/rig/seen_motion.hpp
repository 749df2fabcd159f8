// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
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

/// How such a point depends on the motions of the rig until late right images were exposed: d prediction
/// minus d second measurement.
struct LatePoint {
  static constexpr int kTerms = 9;  ///< turn and step before the first exposure, step before the second

  Matrix3<double> by_second_turn = Matrix3<double>::Zero();  ///< before the second exposure, px/rad
  Eigen::Matrix<double, 3, kTerms> by_exposures = Eigen::Matrix<double, 3, kTerms>::Zero();  ///< px/rad, px/m
};

/// A motion between two stereo frames, and the points that were measured in both.
struct SeenMotion {
  Pose T_first_second;
  std::vector<TwoFramePoint> points;
  std::vector<LatePoint> late{};  ///< of each point, if right images are late
  antipode::Vector<double, 1 + LatePoint::kTerms> sigma_late =
      antipode::Vector<double, 1 + LatePoint::kTerms>::Zero();  ///< of the delay and these terms
};

/// What was learned of the rig since a motion was measured: its change to first order.
struct MotionChange {
  Vector6<double> change = Vector6<double>::Zero();        ///< on the right, rad and m
  Matrix6<double> nonlinearity = Matrix6<double>::Zero();  ///< covariance of what is not of first order
  bool is_corrected = false;  ///< false if the motion stays: it does not depend on what was learned
  /// Of the motion, due to what is not known of the rig: as it was measured, and once it is corrected.
  Matrix6<double> covariance_before = Matrix6<double>::Zero(), covariance = Matrix6<double>::Zero();

  /// The motion with a share of the change.
  [[nodiscard]] Pose of(const Pose& motion, double share = 1.0) const {
    return motion.boxplus(share * change).renormalized();
  }
};

/// The same of the pose of a frame relative to its keyframe.
struct FrameChange {
  std::size_t position = 0;  ///< number of the frame
  MotionChange change;
};

}  // namespace stereo_slam
