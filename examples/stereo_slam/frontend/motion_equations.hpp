// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/camera_errors.hpp"
#include "stereo_slam/frontend/image_displacement.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/frontend/rectification_residual.hpp"

namespace stereo_slam {

/// Squared Mahalanobis distance at which the weight of a measurement halves: Cauchy's weights.
inline constexpr double kCauchyScale2 = 6.0;

/// Normal equations of a motion and of the coefficients of the disparity offset and of the lens. If the rig
/// vibrates, a displacement of the second right image against the first is a further unknown.
struct MotionEquations {
  static constexpr int kField = RectificationResidual::kTerms;
  static constexpr int kLens = LensResidual::kTerms;
  static constexpr int kBias = CameraErrors::kTerms;
  static constexpr int kDisplacement = ImageDisplacement::kTerms;
  static_assert(kField + kLens == kBias);
  using PoseByBias = Eigen::Matrix<double, 6, kBias>;
  using MeasurementByBias = Eigen::Matrix<double, 3, kBias>;
  static constexpr double kUnknown_px = 10.0;  // standard deviation of the displacement

  Matrix6<double> pose_pose = Matrix6<double>::Zero();
  PoseByBias pose_bias = PoseByBias::Zero(), pose_second = PoseByBias::Zero();
  CameraErrors::Information bias_bias = CameraErrors::Information::Zero();
  Vector6<double> pose_vector = Vector6<double>::Zero();
  CameraErrors::Coefficients bias_vector = CameraErrors::Coefficients::Zero();

  ImageDisplacement::Covariance displacement =
      ImageDisplacement::Covariance::Identity() / (kUnknown_px * kUnknown_px);
  Eigen::Matrix<double, 6, kDisplacement> pose_displacement = Eigen::Matrix<double, 6, kDisplacement>::Zero();
  Eigen::Matrix<double, kBias, kDisplacement> bias_displacement =
      Eigen::Matrix<double, kBias, kDisplacement>::Zero();
  ImageDisplacement::Coefficients displacement_vector = ImageDisplacement::Coefficients::Zero();

  /// d z / d coefficients of a measurement.
  [[nodiscard]] static MeasurementByBias derivative_of(const StereoPoint& z,
                                                       const RectificationResidual& residual) {
    const Vector2<double> left_px = residual.left_position(z);
    MeasurementByBias result = MeasurementByBias::Zero();
    result.block<1, kField>(2, 0) = residual.basis(left_px).transpose();
    const Vector2<double> right_px = residual.lens().in_image({z.x() - z.z(), z.y()});
    result.block<2, kLens>(0, kField) = residual.lens().basis(left_px);
    result.block<1, kLens>(2, kField) =
        (residual.lens().basis(left_px) - residual.lens().basis(right_px)).row(0);
    return result;
  }

  /// `applied` are the coefficients that the points were measured with.
  void add(const BiasConstraint& c, const RectificationResidual& residual,
           const CameraErrors::Coefficients& applied, const StereoCamera* vibrating) {
    const MeasurementByBias second = derivative_of(c.second, residual);
    const MeasurementByBias D = second - c.J_first * derivative_of(c.first, residual);
    const double distance2 = c.innovation.dot(c.S_inverse * c.innovation);
    const Matrix3<double> W = c.S_inverse / (1.0 + distance2 / kCauchyScale2);
    // innovation - J_pose xi + D (bias - applied) should vanish
    const Vector3<double> e = c.innovation - D * applied;
    pose_pose += c.J_pose.transpose() * W * c.J_pose;
    pose_bias -= c.J_pose.transpose() * W * D;
    pose_second.leftCols<kField>() -= c.J_pose.transpose() * W * second.leftCols<kField>();
    bias_bias += D.transpose() * W * D;
    pose_vector += c.J_pose.transpose() * W * e;
    bias_vector -= D.transpose() * W * e;
    if (!vibrating) return;
    const Vector2<double> right_px(c.second.x() - c.second.z(), c.second.y());
    const Eigen::Matrix<double, 1, kDisplacement> G = ImageDisplacement::basis(right_px, *vibrating).row(0);
    const Vector3<double> w = W.col(2);
    displacement += G.transpose() * W(2, 2) * G;
    pose_displacement -= c.J_pose.transpose() * w * G;
    bias_displacement += D.transpose() * w * G;
    displacement_vector -= G.transpose() * w.dot(e);
  }

  /// Solves for the displacement and eliminates it.
  void eliminate_displacement() {
    const ImageDisplacement::Covariance inverse =
        displacement.ldlt().solve(ImageDisplacement::Covariance::Identity());
    pose_pose -= pose_displacement * inverse * pose_displacement.transpose();
    pose_bias -= pose_displacement * inverse * bias_displacement.transpose();
    bias_bias -= bias_displacement * inverse * bias_displacement.transpose();
    pose_vector -= pose_displacement * inverse * displacement_vector;
    bias_vector -= bias_displacement * inverse * displacement_vector;
  }
};

}  // namespace stereo_slam
