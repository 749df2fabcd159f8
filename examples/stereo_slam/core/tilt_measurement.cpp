// SPDX-License-Identifier: MIT
#include "stereo_slam/core/tilt_measurement.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <antipode/geometry/jacobians.hpp>

namespace stereo_slam {
namespace {

using TiltMatrix = antipode::Matrix<double, 2>;
using TiltByTurn = antipode::Matrix<double, 2, 3>;

[[nodiscard]] Vector3<double> vertical_in(const Pose& T_first_keyframe, const Vector3<double>& vertical) {
  return T_first_keyframe.rotation_matrix().transpose() * vertical;
}

[[nodiscard]] Pose turned_by(const Vector3<double>& angle_rad) {
  Vector6<double> xi = Vector6<double>::Zero();
  xi.head<3>() = angle_rad;
  return Pose::exp(xi);
}

/// How large a covariance is in units of another one, along axes that are independent in both.
struct RelativeSize {
  TiltMatrix whitening;  ///< L with L unit L^T = I and L covariance L^T = diag(ratios)
  Vector2<double> ratios;

  RelativeSize(const TiltMatrix& unit, const TiltMatrix& covariance) {
    const TiltMatrix to_unit = unit.llt().matrixL().solve(TiltMatrix::Identity());
    const Eigen::SelfAdjointEigenSolver<TiltMatrix> solver(to_unit * covariance * to_unit.transpose());
    whitening = solver.eigenvectors().transpose() * to_unit;
    ratios = solver.eigenvalues();
  }
};

/// The smallest covariance that makes `known` as large as `wanted` in all directions.
[[nodiscard]] TiltMatrix missing(const TiltMatrix& known, const TiltMatrix& wanted) {
  const RelativeSize size(known, wanted);
  const TiltMatrix axes = size.whitening.inverse();
  return axes * (size.ratios.array() - 1.0).cwiseMax(0.0).matrix().asDiagonal() * axes.transpose();
}

}  // namespace

TiltResidual residual_of(const TiltMeasurement& tilt, const Pose& T_first_keyframe) {
  const Vector3<double> u = vertical_in(T_first_keyframe, tilt.vertical_first);
  // After a perturbation phi it is Exp(-phi) u = u + [u] phi.
  return {tilt.whitening * (u - tilt.vertical), tilt.whitening * antipode::skew(u)};
}

LinkedPose with_tilt(const LinkedPose& T_first_keyframe, const TiltMeasurement& tilt) {
  const auto& [pose, covariance] = T_first_keyframe.estimate;
  const TiltResidual residual = residual_of(tilt, pose);
  const antipode::Matrix<double, 6, 2> with_residual =
      covariance.leftCols<3>() * residual.jacobian.transpose();
  const TiltMatrix S = residual.jacobian * with_residual.topRows<3>() + TiltMatrix::Identity();
  const antipode::Matrix<double, 6, 2> gain = S.llt().solve(with_residual.transpose()).transpose();
  Matrix6<double> kept = Matrix6<double>::Identity();
  kept.leftCols<3>() -= gain * residual.jacobian;
  const Matrix6<double> P = kept * covariance * kept.transpose() + gain * gain.transpose();
  return {{pose.boxplus(-gain * residual.value).renormalized(), 0.5 * (P + P.transpose())},
          kept * T_first_keyframe.J_common};
}

Pose levelling_turn(const Pose& T_first_keyframe, const TiltMeasurement& tilt) {
  const Vector3<double> u = vertical_in(T_first_keyframe, tilt.vertical_first);
  const Vector3<double> axis = tilt.vertical.cross(u);
  const double sine = axis.norm();
  if (!(sine > 0.0)) return Pose::identity();
  return turned_by(std::atan2(sine, tilt.vertical.dot(u)) / sine * axis);
}

TiltMeasurement turned(const TiltMeasurement& tilt, const Vector3<double>& turn_rad) {
  TiltMeasurement result = tilt;
  result.vertical = vertical_in(turned_by(turn_rad), tilt.vertical);
  return result;
}

Matrix6<double> common_error_per_rad(const PoseGaussian& link, const TiltMeasurement& tilt) {
  Matrix6<double> per_rad = common_error_per_rad(link).asDiagonal();
  per_rad.topRows<3>() = (tilt.vertical * tilt.vertical.transpose() * per_rad.topRows<3>()).eval();
  return per_rad;
}

LinkedPose add_link(const LinkedPose& T_first_b, const PoseGaussian& T_b_c, bool measured,
                    const std::optional<TiltMeasurement>& tilt) {
  if (!tilt) return add_link(T_first_b, T_b_c, measured);
  LinkedPose T_first_c = compose(T_first_b, T_b_c);
  if (measured) T_first_c.J_common += common_error_per_rad(T_b_c, *tilt);
  return with_tilt(T_first_c, *tilt);
}

LevelledLink level(const LinkedPose& T_first_previous, const PoseGaussian& link,
                   const Vector3<double>& vertical_first, const KnownTurn& turn) {
  constexpr double kWaits = 0.95;  // of the variance of a composed tilt: the reported one has 5 % too much
  const Pose composed = T_first_previous.estimate.pose * link.pose;
  TiltMeasurement tilt{.vertical_first = vertical_first,
                       .vertical = vertical_in(composed * turned_by(turn.mean), vertical_first)};
  const Pose levelling = levelling_turn(composed, tilt);
  PoseGaussian levelled = link;
  levelled.pose = (link.pose * levelling).renormalized();

  TiltByTurn across;  // two axes across the vertical
  across.row(0) = tilt.vertical.unitOrthogonal().transpose();
  across.row(1) = tilt.vertical.cross(across.row(0).transpose()).transpose();
  const TiltByTurn of_turn = across * antipode::skew(tilt.vertical);
  const auto tilt_of = [&](const auto& P) -> TiltMatrix { return of_turn * P * of_turn.transpose(); };
  Matrix3<double> rotation = link.covariance.topLeftCorner<3, 3>();
  const Matrix3<double> before =
      compose(T_first_previous, levelled).estimate.covariance.topLeftCorner<3, 3>() - rotation;
  const TiltMatrix after = tilt_of(turn.covariance);
  rotation += of_turn.transpose() * missing(tilt_of(before + rotation), after) * of_turn;
  levelled.covariance.topLeftCorner<3, 3>() = rotation;
  const RelativeSize size(tilt_of(before + rotation), after);
  for (int i = 0; i < 2; ++i) {
    const double ratio = size.ratios[i];
    if (ratio > 0.0 && ratio < kWaits)
      tilt.whitening.row(i) = std::sqrt(1.0 / ratio - 1.0) * size.whitening.row(i) * across;
  }
  return {levelled, tilt, {.turn = levelling.log().head<3>()}};
}

}  // namespace stereo_slam
