// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/motion_fusion.hpp"

#include <cmath>
#include <tuple>

#include <antipode/geometry/jacobians.hpp>

#include "stereo_slam/core/symmetric_solve.hpp"

namespace stereo_slam {
namespace {

/// The rows of the pose.
template <int Columns>
[[nodiscard]] antipode::Matrix<double, 6, Columns> pose_rows(
    const antipode::Matrix<double, InertialChart::kDim, Columns>& X) {
  antipode::Matrix<double, 6, Columns> rows;
  rows << X.template middleRows<3>(StatePart::kPhi), X.template middleRows<3>(StatePart::kRho);
  return rows;
}

/// The columns of the pose of a covariance.
[[nodiscard]] StateByPose pose_columns(const StateMatrix& P) {
  return pose_rows<InertialChart::kDim>(P).transpose();
}

/// The share of the drift that is left at the end of a motion: it is a first-order Gauss-Markov process.
[[nodiscard]] double kept_drift(const ReadMotion& read) {
  constexpr double kCorrelation_s = 10.0;  // after four, the longest that was measured, most of it is left
  return std::exp(-read.motion.duration_s / kCorrelation_s);
}

/// The noise of a step: that of the readings; that of the derivative by the delay, as far as the delay is
/// unknown; and what changes of the clocks and of the drift of the images.
[[nodiscard]] StateMatrix noise_of(const ReadMotion& read, const InertialState& previous) {
  constexpr double kClockWalk = 5e-5;  // s/sqrt(s): quartz clocks differ by some 50 us in a second
  StateMatrix Q = read.motion.noise_in<InertialChart>();
  const double variance = previous.covariance(StatePart::kDelay, StatePart::kDelay);
  Q.diagonal().head<6>() += variance * read.by_delay_variance;
  Q(StatePart::kDelay, StatePart::kDelay) += kClockWalk * kClockWalk * read.motion.duration_s;
  const double kept = kept_drift(read);
  Q.diagonal().segment<6>(StatePart::kDrift).setConstant(1.0 - kept * kept);
  return Q;
}

/// How the state at the end of a motion depends on the drift of the images: the pose that they show turns and
/// moves relative to the IMU, and velocity and gravity, whose axes are those of the reference, turn with it.
/// The path, which has this pose, is turned from the true one.
[[nodiscard]] StateByPose by_drift(const antipode::ExtendedPose<double, 3>& end,
                                   const Vector6<double>& drift) {
  const Matrix3<double> R_end_reference = end.pose.rotation_matrix().transpose();
  const Matrix3<double> angles = drift.head<3>().asDiagonal();
  StateByPose result = StateByPose::Zero();
  result.block<3, 3>(StatePart::kPhi, 0) = angles;
  result.block<3, 3>(StatePart::kNu, 0) =
      -antipode::skew(Vector3<double>(R_end_reference * end.velocity)) * angles;
  result.block<3, 3>(StatePart::kGamma, 0) =
      -antipode::skew(Vector3<double>(R_end_reference * end.vectors.col(0))) * angles;
  result.block<3, 3>(StatePart::kRho, 3) = drift.tail<3>().asDiagonal();
  result.block<3, 3>(StatePart::kPath, 0) = -R_end_reference.transpose() * angles;
  return result;
}

/// How the state at the end of a motion depends on that at its beginning.
[[nodiscard]] StateMatrix jacobian_of(const ReadMotion& read, const StateByPose& of_drift) {
  // A reading x of the IMU's axes changes by turn x x, and the motion with it as with the opposite bias.
  StateMatrix F = read.motion.jacobian_in<InertialChart>();
  F.block<12, 3>(0, StatePart::kTurn) =
      F.block<12, 3>(0, StatePart::kGyro) * antipode::skew(Vector3<double>(read.mean.head<3>())) +
      F.block<12, 3>(0, StatePart::kAccel) * antipode::skew(Vector3<double>(read.mean.tail<3>()));
  F.block<12, 1>(0, StatePart::kDelay) = read.by_delay;
  F.block<6, 3>(StatePart::kNu, StatePart::kOffset) = read.by_offset;
  F.middleCols<6>(StatePart::kDrift) = of_drift;
  F.block<6, 6>(StatePart::kDrift, StatePart::kDrift) = kept_drift(read) * Matrix6<double>::Identity();
  return F;
}

}  // namespace

Pose InertialStep::T_previous_current() const {
  return (T_reference_previous.inverse() * std::get<0>(state.state).pose).renormalized();
}

Matrix6<double> InertialStep::pose_regression() const {
  return solve_symmetric(previous, pose_rows<6>(cross).transpose()).transpose();
}

InertialStep step(const InertialState& previous, const ReadMotion& read) {
  const auto moved = read.motion(previous.state);
  const StateByPose of_drift = by_drift(std::get<0>(moved), read.drift);
  const StateMatrix F = jacobian_of(read, of_drift);
  antipode::Vector<double, InertialChart::kDim> besides = of_drift * std::get<5>(previous.state);
  besides.segment<6>(StatePart::kNu) += read.by_offset * std::get<4>(previous.state);
  besides.segment<6>(StatePart::kDrift) = (kept_drift(read) - 1.0) * std::get<5>(previous.state);
  InertialStep result;
  result.state.state = InertialChart::normalized(InertialChart::retract(moved, besides));
  const StateMatrix P = F * previous.covariance * F.transpose() + noise_of(read, previous);
  result.state.covariance = 0.5 * (P + P.transpose());
  const StateByPose with_pose = pose_columns(previous.covariance);
  result.T_reference_previous = std::get<0>(previous.state).pose;
  result.previous = pose_rows<6>(with_pose);
  result.cross = F * with_pose;
  return result;
}

FusedStep fuse(const InertialStep& step, const PoseGaussian& T_previous_current) {
  // With the errors x of the previous pose and y of the state, the motion has the error y_pose - A x.
  const Pose predicted = step.T_previous_current();
  const Matrix6<double> A = predicted.inverse().adjoint();
  const StateMatrix& P = step.state.covariance;
  const StateByPose with_motion = pose_columns(P) - step.cross * A.transpose();
  const Matrix6<double> previous_with_motion =
      pose_rows<6>(step.cross).transpose() - step.previous * A.transpose();
  Matrix6<double> S = pose_rows<6>(with_motion) - A * previous_with_motion + T_previous_current.covariance;
  S = (0.5 * (S + S.transpose())).eval();
  const Vector6<double> innovation = (predicted.inverse() * T_previous_current.pose).log();
  const Matrix6<double> S_inverse = solve_symmetric(S, Matrix6<double>::Identity());
  const StateByPose gain = with_motion * S_inverse;

  FusedStep fused{.step = step, .nis = innovation.dot(S_inverse * innovation)};
  auto& [state, T_reference_previous, previous, cross] = fused.step;
  state.state = InertialChart::normalized(InertialChart::retract(state.state, gain * innovation));
  state.covariance -= gain * with_motion.transpose();
  state.covariance = (0.5 * (state.covariance + state.covariance.transpose())).eval();
  cross -= gain * previous_with_motion.transpose();
  return fused;
}

}  // namespace stereo_slam
