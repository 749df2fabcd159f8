// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/image_displacement.hpp"

namespace stereo_slam {

/// A point that was known before the frame, as measured in both of the frame's images, linearised at a pose
/// of the camera and at a displacement of the right image.
struct DisplacementConstraint {
  Vector3<double> innovation;          ///< measured (u, v, disparity) minus that expected
  Matrix3<double> S_inverse;           ///< information of the innovation
  Eigen::Matrix<double, 3, 6> J_pose;  ///< d expected / d pose
  double row_error_px = 0.0;           ///< left minus right row
  ImageDisplacement::Basis basis;      ///< d (disparity, row error) / d displacement
};

/// What is known of the pose and the displacement without the points: Gaussians, relative to the pose and the
/// displacement that the points are linearised at.
struct DisplacementPrior {
  Matrix6<double> pose_information = Matrix6<double>::Zero();
  ImageDisplacement::Coefficients mean = ImageDisplacement::Coefficients::Zero();  ///< px
  ImageDisplacement::Covariance information = ImageDisplacement::Covariance::Zero();
};

/// Pose of a frame and displacement of its right image, both relative to those of the linearisation.
struct DisplacementEstimate {
  Vector6<double> pose_change = Vector6<double>::Zero();
  ImageDisplacement::Coefficients change = ImageDisplacement::Coefficients::Zero();      ///< px
  ImageDisplacement::Covariance covariance = ImageDisplacement::Covariance::Identity();  ///< px^2
  /// d pose / d displacement: how the pose that the points give depends on it.
  Eigen::Matrix<double, 6, ImageDisplacement::kTerms> pose_by_displacement =
      Eigen::Matrix<double, 6, ImageDisplacement::kTerms>::Zero();
  int agreeing = 0;  ///< points within three standard deviations in the disparity, and in the row

  /// Covariance of a pose measured with a displacement, due to the covariance of that.
  [[nodiscard]] Matrix6<double> pose_covariance(const ImageDisplacement::Covariance& of_displacement) const {
    return pose_by_displacement * of_displacement * pose_by_displacement.transpose();
  }
};

/// The pose and the displacement that the points agree on, by iteratively reweighted least squares with
/// Cauchy weights whose scale follows the median of the residuals. The rows alone determine b, c and e; the
/// disparities determine a and d as far as the pose is known from the left image. Nothing if the equations
/// are singular.
[[nodiscard]] std::optional<DisplacementEstimate> estimate_displacement(
    std::span<const DisplacementConstraint> points, const DisplacementPrior& prior);

}  // namespace stereo_slam
