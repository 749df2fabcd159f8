// SPDX-License-Identifier: MIT
#pragma once

#include <limits>

#include <ceres/manifold.h>

#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// Poses as parameter blocks of Ceres.
namespace antipode {

/// Tells Ceres that eight parameters [q; p] are a pose: Plus(x, xi) = x exp(xi), Minus(y, x) = log(x^-1 y).
///
/// The tangent is xi = (phi, rho), so ceres::Covariance in tangent space is the covariance of the right
/// perturbation, in the order every other part of the library uses. Cost functions read the block as
/// ConstDualQuaternionView<T>(block). Plus renormalises, so that a pose stays on the Study quadric however
/// many steps the solver takes.
class PoseManifold final : public ceres::Manifold {
 public:
  /// 8, the numbers of a dual quaternion.
  [[nodiscard]] int AmbientSize() const override { return 8; }
  /// 6, the numbers of xi.
  [[nodiscard]] int TangentSize() const override { return 6; }

  /// x exp(xi). False if xi or x is not finite or the real part q of x is zero: the solver then shortens its
  /// step.
  bool Plus(const double* x, const double* xi, double* x_plus_xi) const override {
    const Pose pose(x);
    const Eigen::Map<const Vector6<double>> twist(xi);
    const bool has_rotation = pose.real().squaredNorm() >= std::numeric_limits<double>::min();
    if (!has_rotation || !pose.coeffs().allFinite() || !twist.allFinite()) {
      return false;
    }
    DualQuaternionView<double>{x_plus_xi} = pose.boxplus(twist).renormalized();
    return true;
  }

  /// The derivative of x exp(xi) by xi at zero, 8 x 6, row by row. Always true. To first order,
  /// xi = 2 (vec e, vec f) and x exp(xi) = x (1 + e + eps f).
  bool PlusJacobian(const double* x, double* jacobian) const override {
    const Pose pose(x);
    Eigen::Map<Matrix8x6> J(jacobian);
    J.topLeftCorner<4, 3>() = 0.5 * left_matrix(pose.real()).rightCols<3>();
    J.topRightCorner<4, 3>().setZero();
    J.bottomLeftCorner<4, 3>() = 0.5 * left_matrix(pose.dual()).rightCols<3>();
    J.bottomRightCorner<4, 3>() = J.topLeftCorner<4, 3>();
    return true;
  }

  /// log(x^-1 y), six numbers. Always true.
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6<double>>{y_minus_x} = Pose(y).boxminus(Pose(x));
    return true;
  }

  /// 6 x 8, row by row: the derivative of log(x^-1 y) by y at y = x. Always true.
  bool MinusJacobian(const double* x, double* jacobian) const override {
    const auto inverse = Pose(x).inverse();
    Eigen::Map<Matrix6x8> J(jacobian);
    J.topLeftCorner<3, 4>() = 2.0 * left_matrix(inverse.real()).bottomRows<3>();
    J.topRightCorner<3, 4>().setZero();
    J.bottomLeftCorner<3, 4>() = 2.0 * left_matrix(inverse.dual()).bottomRows<3>();
    J.bottomRightCorner<3, 4>() = J.topLeftCorner<3, 4>();
    return true;
  }

 private:
  using Pose = ConstDualQuaternionView<double>;
  using Matrix8x6 = Eigen::Matrix<double, 8, 6, Eigen::RowMajor>;
  using Matrix6x8 = Eigen::Matrix<double, 6, 8, Eigen::RowMajor>;
};

}  // namespace antipode
