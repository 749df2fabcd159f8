// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/sized_cost_function.h>

#include <antipode/ceres/pose_manifold.hpp>

#include "stereo_slam/core/tilt_measurement.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// A TiltMeasurement for Ceres, between the pose of the first keyframe and that of the keyframe: blocks of
/// eight parameters that antipode::PoseManifold describes. Jacobians are analytic, as those of
/// antipode::RelativePoseCost.
class TiltCost final : public ceres::SizedCostFunction<2, 8, 8> {
 public:
  explicit TiltCost(const TiltMeasurement& tilt) : tilt_(tilt) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Pose T_world_first = antipode::ConstDualQuaternionView<double>(parameters[0]);
    const Pose T_world_keyframe = antipode::ConstDualQuaternionView<double>(parameters[1]);
    const Pose T_first_keyframe = T_world_first.inverse() * T_world_keyframe;
    const TiltResidual residual = residual_of(tilt_, T_first_keyframe);
    Eigen::Map<Vector2<double>>{residuals} = residual.value;
    if (jacobians == nullptr) return residual.value.allFinite();
    // A turn of the first keyframe is the opposite turn of the keyframe, in its axes.
    const Matrix3<double> R_keyframe_first = T_first_keyframe.rotation_matrix().transpose();
    write_jacobian(-residual.jacobian * R_keyframe_first, parameters[0], jacobians[0]);
    write_jacobian(residual.jacobian, parameters[1], jacobians[1]);
    return residual.value.allFinite();
  }

 private:
  using ByTurn = antipode::Matrix<double, 2, 3>;

  /// By the eight parameters, so that the product with PlusJacobian is the derivative by the pose.
  static void write_jacobian(const ByTurn& by_turn, const double* pose, double* jacobian) {
    if (jacobian == nullptr) return;
    Eigen::Matrix<double, 6, 8, Eigen::RowMajor> J_minus;
    antipode::PoseManifold().MinusJacobian(pose, J_minus.data());
    Eigen::Map<Eigen::Matrix<double, 2, 8, Eigen::RowMajor>>{jacobian} = by_turn * J_minus.topRows<3>();
  }

  TiltMeasurement tilt_;
};

}  // namespace stereo_slam
