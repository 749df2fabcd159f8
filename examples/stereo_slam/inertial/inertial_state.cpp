// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/inertial_state.hpp"

#include <array>
#include <tuple>
#include <utility>

#include <antipode/distributions/keyframe_change.hpp>
#include <antipode/geometry/jacobians.hpp>

namespace stereo_slam {
namespace {

constexpr double kVelocitySigma_m_s = 20.0;
constexpr double kPoseVariance = 1e-10;  // of the reference itself: a covariance must not be singular

void set_variance(StateMatrix& P, int block, double sigma) {
  P.block<3, 3>(block, block) = sigma * sigma * Matrix3<double>::Identity();
}

/// The covariance A P A^T, symmetric in spite of rounding errors.
[[nodiscard]] StateMatrix congruence(const StateMatrix& A, const StateMatrix& P) {
  const StateMatrix Q = A * P * A.transpose();
  return 0.5 * (Q + Q.transpose());
}

}  // namespace

InertialState unknown_state(double delay_sigma_s) {
  constexpr double kGyroscopeBias = 0.1, kAccelerometerBias = 0.3;  // those of cheap sensors
  constexpr double kTurn_rad = 0.0175, kOffset_m = 0.02;  // a drawing is that good, and Kalibr better
  InertialState state;
  StateMatrix& P = state.covariance;
  set_variance(P, StatePart::kNu, kVelocitySigma_m_s);
  set_variance(P, StatePart::kGamma, kGravity);
  set_variance(P, StatePart::kGyro, kGyroscopeBias);
  set_variance(P, StatePart::kAccel, kAccelerometerBias);
  set_variance(P, StatePart::kTurn, kTurn_rad);
  set_variance(P, StatePart::kOffset, kOffset_m);
  P.block<6, 6>(StatePart::kDrift, StatePart::kDrift).setIdentity();
  P(StatePart::kDelay, StatePart::kDelay) = delay_sigma_s * delay_sigma_s;
  P.block<3, 3>(StatePart::kPhi, StatePart::kPhi).diagonal().setConstant(kPoseVariance);
  P.block<3, 3>(StatePart::kRho, StatePart::kRho).diagonal().setConstant(kPoseVariance);
  return state;
}

InertialState relative_to_itself(const InertialState& state) {
  // The path has the pose of the IMU as it is estimated: its errors add up.
  const Matrix3<double> R_imu_reference = std::get<0>(state.state).pose.rotation_matrix().transpose();
  InertialState moved = state;
  auto& path = std::get<6>(moved.state);
  path = (R_imu_reference * path).eval();
  StateMatrix A = StateMatrix::Identity();
  A.block<3, 3>(StatePart::kPath, StatePart::kPath) = R_imu_reference;
  A.block<3, 3>(StatePart::kPath, StatePart::kPhi).setIdentity();
  moved.covariance = congruence(A, state.covariance);
  InertialState itself = antipode::change_keyframe(moved).state;
  itself.covariance.block<3, 3>(StatePart::kPhi, StatePart::kPhi).diagonal().setConstant(kPoseVariance);
  itself.covariance.block<3, 3>(StatePart::kRho, StatePart::kRho).diagonal().setConstant(kPoseVariance);
  return itself;
}

InertialState at_pose(const InertialState& itself, const PoseGaussian& T_reference_imu) {
  // v = R u: with the error phi of R independent of that of u, nu = nu' - [u] phi, and so for gravity.
  InertialState state = itself;
  auto& x = std::get<0>(state.state);
  const Matrix3<double> R = T_reference_imu.pose.rotation_matrix();
  const Vector3<double> u = x.velocity, g = x.vectors.col(0);
  x.pose = T_reference_imu.pose;
  x.velocity = R * u;
  x.vectors.col(0) = R * g;
  StateMatrix P = itself.covariance;
  for (const int block : {StatePart::kPhi, StatePart::kRho}) {
    P.middleRows<3>(block).setZero();
    P.middleCols<3>(block).setZero();
  }
  const Matrix6<double>& pose = T_reference_imu.covariance;
  P.block<3, 3>(StatePart::kPhi, StatePart::kPhi) = pose.topLeftCorner<3, 3>();
  P.block<3, 3>(StatePart::kPhi, StatePart::kRho) = pose.topRightCorner<3, 3>();
  P.block<3, 3>(StatePart::kRho, StatePart::kPhi) = pose.bottomLeftCorner<3, 3>();
  P.block<3, 3>(StatePart::kRho, StatePart::kRho) = pose.bottomRightCorner<3, 3>();
  StateMatrix A = StateMatrix::Identity();
  A.block<3, 3>(StatePart::kNu, StatePart::kPhi) = -antipode::skew(u);
  A.block<3, 3>(StatePart::kGamma, StatePart::kPhi) = -antipode::skew(g);
  auto& path = std::get<6>(state.state);
  path = (R * path).eval();
  A.block<3, 3>(StatePart::kPath, StatePart::kPath) = R;
  A.block<3, 3>(StatePart::kPath, StatePart::kPhi) = -R;
  state.covariance = congruence(A, P);
  return state;
}

InertialState with_path_error(const InertialState& state, const Matrix3<double>& covariance) {
  InertialState known = state;
  known.covariance.middleRows<3>(StatePart::kPath).setZero();
  known.covariance.middleCols<3>(StatePart::kPath).setZero();
  known.covariance.block<3, 3>(StatePart::kPath, StatePart::kPath) = covariance;
  std::get<6>(known.state).setZero();
  return known;
}

InertialState without_velocity(const InertialState& itself) {
  InertialState state = unknown_state();
  const auto at_rest = std::exchange(state.state, itself.state);
  std::get<0>(state.state).pose = std::get<0>(at_rest).pose;
  std::get<0>(state.state).velocity = std::get<0>(at_rest).velocity;
  constexpr int kKnown = InertialChart::kDim - StatePart::kGamma;
  state.covariance.bottomRightCorner<kKnown, kKnown>() =
      itself.covariance.bottomRightCorner<kKnown, kKnown>();
  return state;
}

PoseGaussian conjugated(const Pose& T_b_a, const PoseGaussian& X) {
  const Matrix6<double> A = T_b_a.adjoint();
  const Matrix6<double> P = A * X.covariance * A.transpose();
  return {(T_b_a * X.pose * T_b_a.inverse()).renormalized(), 0.5 * (P + P.transpose())};
}

InertialEstimate estimate_of(const InertialState& itself) {
  const auto& [x, biases, turn, delay, offset, drift, path] = itself.state;
  InertialEstimate estimate{.phase = InertialPhase::kRunning,
                            .velocity = x.velocity,
                            .gravity = x.vectors.col(0),
                            .biases = biases,
                            .delay_s = delay[0]};
  constexpr std::array<int, InertialEstimate::kNumbers> kCoordinates = {
      StatePart::kNu,        StatePart::kNu + 1,    StatePart::kNu + 2,    StatePart::kGamma,
      StatePart::kGamma + 1, StatePart::kGamma + 2, StatePart::kGyro,      StatePart::kGyro + 1,
      StatePart::kGyro + 2,  StatePart::kAccel,     StatePart::kAccel + 1, StatePart::kAccel + 2,
      StatePart::kDelay};
  estimate.covariance = itself.covariance(kCoordinates, kCoordinates);
  return estimate;
}

GravityLength gravity_length(const InertialState& state) {
  const auto& x = std::get<0>(state.state);
  const double length = x.vectors.norm();
  if (!(length > 0.0)) return {};
  const Vector3<double> along = x.pose.rotation_matrix().transpose() * (x.vectors.col(0) / length);
  return {length, along.dot(state.covariance.block<3, 3>(StatePart::kGamma, StatePart::kGamma) * along)};
}

InertialState with_known_gravity(const InertialState& state) {
  constexpr double kSigma = 0.03;  // of the length, from place to place
  const GravityLength measured = gravity_length(state);
  if (!(measured.length > 0.0)) return state;
  const auto& x = std::get<0>(state.state);
  const Vector3<double> along = x.pose.rotation_matrix().transpose() * (x.vectors.col(0) / measured.length);
  const antipode::Vector<double, InertialChart::kDim> with_length =
      state.covariance.middleCols<3>(StatePart::kGamma) * along;
  const antipode::Vector<double, InertialChart::kDim> gain =
      with_length / (measured.variance + kSigma * kSigma);
  InertialState known = state;
  known.state = InertialChart::retract(state.state, gain * (kGravity - measured.length));
  known.covariance -= gain * with_length.transpose();
  known.covariance = (0.5 * (known.covariance + known.covariance.transpose())).eval();
  return antipode::with_gravity_length(known, kGravity);
}

}  // namespace stereo_slam
