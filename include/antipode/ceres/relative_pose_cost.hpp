// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>
#include <ceres/sized_cost_function.h>

#include <antipode/ceres/pose_manifold.hpp>
#include <antipode/detail/check.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// Edges of pose graphs for Ceres.
namespace antipode {

/// An edge of a pose graph: a measured relative pose with its full covariance, between two parameter blocks
/// [q; p] that PoseManifold describes.
///
///     r(a, b) = L^-1 e,   e = log(Z^-1 T_a^-1 T_b),   P = L L^T,
///
/// where Z is the measured T_a_b and P the covariance of its right perturbation (rotation first). At the true
/// poses e is the measurement error, so |r|^2 is chi-square with six degrees of freedom.
///
/// Jacobians are analytic. In the tangent spaces of the poses, with x = T_a^-1 T_b,
///
///     de/db = J_r(e)^-1,   de/da = -J_r(e)^-1 Ad(x^-1);
///
/// Ceres expects derivatives by the eight numbers and multiplies them by PlusJacobian. Evaluate therefore
/// returns J MinusJacobian for each Jacobian J, so that this product is J again. The result is the derivative
/// along poses only; off the Study quadric it differs from that of automatic differentiation.
///
/// The sign of either dual quaternion does not matter.
class RelativePoseCost final : public ceres::SizedCostFunction<6, 8, 8> {
 public:
  /// The measured T_a_b and the covariance P [rad^2, rad m, m^2] of its right perturbation. Throws
  /// std::invalid_argument unless P is symmetric and positive definite.
  RelativePoseCost(const DualQuaternion<double>& T_a_b, const Matrix6<double>& covariance)
      : T_b_a_measured_(T_a_b.inverse()), factor_(covariance) {
    (void)detail::checked_covariance<double, 6>(
        "covariance of a relative pose is not finite or not symmetric", covariance);
    if (factor_.info() != Eigen::Success) [[unlikely]] {
      detail::throw_invalid("covariance of a relative pose is not positive definite", covariance);
    }
  }

  /// r (6 numbers) and, if requested, its Jacobians, each 6 x 8, row by row. False if r is not finite.
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const ConstDualQuaternionView<double> T_world_a(parameters[0]);
    const ConstDualQuaternionView<double> T_world_b(parameters[1]);
    const DualQuaternion<double> T_a_b = T_world_a.inverse() * T_world_b;
    const Vector6<double> e = (T_b_a_measured_ * T_a_b).log();
    if (!e.allFinite()) return false;
    Eigen::Map<Vector6<double>> r(residuals);
    r = factor_.matrixL().solve(e);
    if (jacobians == nullptr) return true;
    const Matrix6<double> J_b = factor_.matrixL().solve(se3_right_jacobian_inverse(e));
    if (jacobians[0] != nullptr) {
      write_jacobian(-J_b * T_a_b.inverse().adjoint(), parameters[0], jacobians[0]);
    }
    if (jacobians[1] != nullptr) write_jacobian(J_b, parameters[1], jacobians[1]);
    return true;
  }

 private:
  using Matrix6x8 = Eigen::Matrix<double, 6, 8, Eigen::RowMajor>;

  static void write_jacobian(const Matrix6<double>& J, const double* pose, double* jacobian) {
    Matrix6x8 J_minus;
    PoseManifold().MinusJacobian(pose, J_minus.data());
    Eigen::Map<Matrix6x8>{jacobian} = J * J_minus;
  }

  DualQuaternion<double> T_b_a_measured_;
  Eigen::LLT<Matrix6<double>> factor_;
};

}  // namespace antipode
