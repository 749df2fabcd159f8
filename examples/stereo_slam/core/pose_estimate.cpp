// SPDX-License-Identifier: MIT
#include "stereo_slam/core/pose_estimate.hpp"

#include <algorithm>
#include <cmath>

namespace stereo_slam {

PoseGaussian certain_pose() {
  constexpr double kVariance = 1e-10;
  return {Pose::identity(), kVariance * Matrix6<double>::Identity()};
}

Matrix6<double> unknown_pose_covariance() {
  constexpr double kRotation_rad = 1.0;
  constexpr double kTranslation_m = 100.0;
  Vector6<double> sigma;
  sigma << Vector3<double>::Constant(kRotation_rad), Vector3<double>::Constant(kTranslation_m);
  return sigma.cwiseAbs2().asDiagonal();
}

Vector6<double> common_error_per_rad(const PoseGaussian& link) {
  constexpr double kFullChange_rad = 0.05;  // a third of that between two keyframes of a moving vehicle
  const Vector6<double> variances = link.covariance.diagonal().cwiseMax(0.0);
  const double angle_variance = variances.head<3>().mean();
  if (!(angle_variance > 0.0)) return Vector6<double>::Zero();
  // How far the link moved points of the scene, seen from the camera: their distance is about the ratio of
  // the standard deviations of translation and rotation.
  const double per_m = std::sqrt(angle_variance / std::max(variances.tail<3>().mean(), angle_variance));
  const double change_rad = link.pose.log().head<3>().norm() + link.pose.translation().norm() * per_m;
  return std::min(change_rad / kFullChange_rad, 1.0) * (variances / angle_variance).cwiseSqrt();
}

PoseGaussian LinkedPose::with_common_error(double sigma_rad) const {
  PoseGaussian result = estimate;
  result.covariance += sigma_rad * sigma_rad * J_common * J_common.transpose();
  return result;
}

LinkedPose add_link(const LinkedPose& T_a_b, const PoseGaussian& T_b_c, bool measured) {
  LinkedPose T_a_c = compose(T_a_b, T_b_c);
  if (measured) T_a_c.J_common.diagonal() += common_error_per_rad(T_b_c);
  return T_a_c;
}

LinkedPose compose(const LinkedPose& T_a_b, const PoseGaussian& T_b_c) {
  return {compose_first_order(T_a_b.estimate, T_b_c), T_b_c.pose.inverse().adjoint() * T_a_b.J_common};
}

PoseGaussian with_calibration_error(const PoseGaussian& T_a_b, const CalibrationError& error) {
  const Pose T_b_a = T_a_b.pose.inverse();
  const Vector3<double> along = error.scale_sigma * T_b_a.translation();
  // X T X^-1 = T exp(Ad(T^-1) x - x) to first order in X = exp(x).
  Matrix6x3 turn = error.axes_sigma_rad * T_b_a.adjoint().leftCols<3>();
  turn.topRows<3>().diagonal().array() -= error.axes_sigma_rad;
  PoseGaussian result = T_a_b;
  result.covariance.bottomRightCorner<3, 3>() += along * along.transpose();
  result.covariance += turn * turn.transpose();
  return result;
}

InertialEstimate with_calibration_error(const InertialEstimate& estimate, const CalibrationError& error) {
  InertialEstimate result = estimate;
  const Vector3<double>& v = estimate.velocity;
  const Vector3<double> along = error.scale_sigma * v;
  // [v] [v]^T = |v|^2 I - v v^T: a turn about any axis by the same angle.
  const Matrix3<double> across = v.squaredNorm() * Matrix3<double>::Identity() - v * v.transpose();
  result.covariance.topLeftCorner<3, 3>() +=
      along * along.transpose() + error.axes_sigma_rad * error.axes_sigma_rad * across;
  return result;
}

}  // namespace stereo_slam
