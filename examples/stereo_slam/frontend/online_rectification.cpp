// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/online_rectification.hpp"

#include <cmath>

#include <Eigen/Cholesky>

namespace stereo_slam {
namespace {

constexpr double kRowSigma_px = 0.3;
constexpr double kConfidence =
    0.25;  // weight of a keyframe's disparity information, whose errors are not independent
constexpr double kCauchyScale2 = 6.0;  // squared Mahalanobis distance at which a weight halves

}  // namespace

RectificationResidual::Basis RectificationResidual::basis(const Vector2<double>& left_px) const {
  const double x = 2.0 * (left_px.x() - camera_.cx) / camera_.width_px;
  const double y = 2.0 * (left_px.y() - camera_.cy) / camera_.height_px;
  Basis terms;
  terms << 1.0, x, y, x * x, x * y, y * y;
  return terms;
}

Vector2<double> RectificationResidual::right_position(const StereoPoint& z) const {
  return Vector2<double>(z.x() - z.z(), z.y()) + coefficients_ * basis(z.head<2>());
}

RectificationResidual::Measurement RectificationResidual::measure(const Vector2<double>& left_px,
                                                                  const Vector2<double>& right_px) const {
  const Vector2<double> difference = left_px - right_px + coefficients_ * basis(left_px);
  return {{left_px.x(), left_px.y(), difference.x()}, difference.y()};
}

RectificationEstimator::RectificationEstimator(const StereoCamera& camera,
                                               const OnlineRectificationSettings& settings)
    : camera_(camera) {
  estimate_.row_information /= settings.row_sigma_px * settings.row_sigma_px;
  estimate_.disparity_information /= settings.disparity_sigma_px * settings.disparity_sigma_px;
}

RectificationEstimator RectificationEstimator::resumed(const StereoCamera& camera,
                                                       const RectificationEstimate& estimate) {
  RectificationEstimator estimator;
  estimator.camera_ = camera;
  estimator.estimate_ = estimate;
  return estimator;
}

void RectificationEstimator::add_rows(std::span<const RectificationResidual::Measurement> matches) {
  const RectificationResidual residual = current();
  for (const auto& match : matches) {
    const RectificationResidual::Basis terms = residual.basis(match.z.head<2>());
    const double offset = terms.dot(residual.coefficients().row(1)) - match.row_error_px;
    const double distance2 = match.row_error_px * match.row_error_px / (kRowSigma_px * kRowSigma_px);
    const double weight = 1.0 / (kRowSigma_px * kRowSigma_px * (1.0 + distance2 / kCauchyScale2));
    estimate_.row_information += weight * terms * terms.transpose();
    estimate_.row_vector += weight * offset * terms;
  }
}

void RectificationEstimator::add_motion(std::span<const BiasConstraint> constraints) {
  constexpr std::size_t kMinConstraints = 30;
  if (constraints.size() < kMinConstraints) return;
  using Information = RectificationEstimate::Information;
  using Basis = RectificationEstimate::Basis;
  Matrix6<double> pose_pose = Matrix6<double>::Zero();
  Information pose_bias = Information::Zero();
  Information bias_bias = Information::Zero();
  Vector6<double> pose_vector = Vector6<double>::Zero();
  Basis bias_vector = Basis::Zero();
  const RectificationResidual residual = current();
  const Basis applied = residual.coefficients().row(0);
  for (const auto& c : constraints) {
    Eigen::Matrix<double, 3, RectificationResidual::kTerms> D =
        -c.J_disparity * residual.basis(c.first_px).transpose();
    D.row(2) += residual.basis(c.second_px).transpose();
    const double distance2 = c.innovation.dot(c.S_inverse * c.innovation);
    const Matrix3<double> W = c.S_inverse / (1.0 + distance2 / kCauchyScale2);
    // innovation - J_pose xi + D (bias - applied) should vanish
    const Vector3<double> e = c.innovation - D * applied;
    pose_pose += c.J_pose.transpose() * W * c.J_pose;
    pose_bias -= c.J_pose.transpose() * W * D;
    bias_bias += D.transpose() * W * D;
    pose_vector += c.J_pose.transpose() * W * e;
    bias_vector -= D.transpose() * W * e;
  }
  const Eigen::LDLT<Matrix6<double>> factor(pose_pose);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return;
  estimate_.disparity_information +=
      kConfidence * (bias_bias - pose_bias.transpose() * factor.solve(pose_bias));
  estimate_.disparity_vector +=
      kConfidence * (bias_vector - pose_bias.transpose() * factor.solve(pose_vector));
}

void RectificationEstimator::advance() {
  const auto& e = estimate_;
  RectificationResidual::Coefficients coefficients;
  coefficients.row(0) = e.disparity_information.ldlt().solve(e.disparity_vector).transpose();
  coefficients.row(1) = e.row_information.ldlt().solve(e.row_vector).transpose();
  estimate_.coefficients = coefficients;
}

}  // namespace stereo_slam
