// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/motion_fusion.hpp"

#include <array>
#include <new>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <antipode/filters/marginal_update.hpp>
#include <antipode/geometry/jacobians.hpp>

#include "stereo_slam/support/flight.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// A state with a random covariance of usual size.
[[nodiscard]] InertialState random_state(std::mt19937_64& random) {
  InertialState state = unknown_state();
  auto& x = std::get<0>(state.state);
  x.pose = measured(Pose::identity(), 0.5, 1.0, random).pose;
  x.velocity = normal3(random, 1.0);
  x.vectors.col(0) = Vector3<double>(0.0, 0.0, -kGravity);
  std::normal_distribution<double> normal(0.0, 1e-3);
  StateMatrix A;
  for (double& a : A.reshaped()) a = normal(random);
  state.covariance = A * A.transpose();
  return state;
}

/// The motion of a flight over a frame, by readings in axes that are turned by a rotation vector.
[[nodiscard]] ReadMotion motion_of(const Flight& flight,
                                   const Vector3<double>& turn_rad = Vector3<double>::Zero()) {
  Vector6<double> xi = Vector6<double>::Zero();
  xi.head<3>() = turn_rad;
  const Matrix3<double> R = Pose::exp(xi).rotation_matrix();
  ReadMotion read;
  std::vector<ImuSample> samples;
  for (int i = 0; i <= 10; ++i) {
    ImuSample sample = flight.reading(i * kSample_ns);
    sample.angular_velocity = (R * sample.angular_velocity).eval();
    sample.specific_force = (R * sample.specific_force).eval();
    read.mean.head<3>() += sample.angular_velocity / 11.0;
    read.mean.tail<3>() += sample.specific_force / 11.0;
    samples.push_back(sample);
  }
  read.motion = antipode::integrate_imu<double>(samples, {0, kFrame_ns}, antipode::Vector6<double>::Zero(),
                                                {1e-3, 1e-2, 1e-4, 1e-3});
  return read;
}

}  // namespace

TEST_CASE("A motion without information changes nothing, and has no innovation", "[inertial][fusion]") {
  std::mt19937_64 random(1);
  const InertialStep before = step(random_state(random), motion_of(Flight{}));
  const FusedStep fused = fuse(before, {before.T_previous_current(), 1e12 * Matrix6<double>::Identity()});
  CHECK(fused.nis < 1e-20);
  CHECK(fused.step.state.covariance.isApprox(before.state.covariance, 1e-9));
  CHECK(fused.step.pose_regression().isApprox(before.pose_regression(), 1e-9));
}

TEST_CASE("Without an IMU, the motion is added to the pose: the prediction by odometry is a limit",
          "[inertial][fusion]") {
  // An IMU of no use: its noise is a million times that of the motion.
  std::mt19937_64 random(2);
  const InertialState state = random_state(random);
  ReadMotion read = motion_of(Flight{});
  const Pose truth = step(state, read).T_previous_current();
  read.motion.noise = 1e6 * InertialMotion::Square::Identity();
  const PoseGaussian T_previous_current = measured(truth, 1e-3, 1e-2, random);
  const FusedStep fused = fuse(step(state, read), T_previous_current);
  const PoseGaussian before = antipode::pose_marginal(state),
                     after = antipode::pose_marginal(fused.step.state);
  const Matrix6<double> A = T_previous_current.pose.inverse().adjoint();
  const Matrix6<double> P = A * before.covariance * A.transpose() + T_previous_current.covariance;
  // Linear in the innovation of a hundredth, and the IMU's noise has six digits more than the result.
  CHECK(after.pose.boxminus(before.pose * T_previous_current.pose).norm() < 1e-3);
  CHECK(after.covariance.isApprox(P, 0.03));
  CHECK(fused.step.pose_regression().isApprox(A, 0.03));
}

TEST_CASE("Fusing is the update of pose before and state together", "[inertial][fusion]") {
  // The oracle: the joint covariance of pose and state, and the information form of a Gaussian update.
  std::mt19937_64 random(3);
  const InertialStep before = step(random_state(random), motion_of(Flight{}));
  constexpr int kState = InertialChart::kDim, kJoint = 6 + kState;
  using Joint = Eigen::Matrix<double, kJoint, kJoint>;
  Joint joint;
  joint << before.previous, before.cross.transpose(), before.cross, before.state.covariance;
  Eigen::Matrix<double, 6, kJoint> H = Eigen::Matrix<double, 6, kJoint>::Zero();
  H.leftCols<6>() = -before.T_previous_current().inverse().adjoint();
  for (int i = 0; i < 3; ++i) H(i, 6 + i) = H(3 + i, 6 + StatePart::kRho + i) = 1.0;
  const PoseGaussian z = measured(before.T_previous_current(), 1e-4, 1e-3, random);
  const Joint posterior = (joint.inverse() + H.transpose() * z.covariance.inverse() * H).inverse();
  const FusedStep fused = fuse(before, z);
  CHECK(fused.step.state.covariance.isApprox(posterior.bottomRightCorner<kState, kState>(), 1e-6));
  const Vector6<double> innovation = z.pose.boxminus(before.T_previous_current());
  const Eigen::Matrix<double, kJoint, 1> expected =
      posterior * H.transpose() * z.covariance.inverse() * innovation;
  const auto moved = InertialChart::local(before.state.state, fused.step.state.state);
  CHECK((moved - expected.tail<kState>()).norm() < 1e-6 * expected.norm() + 1e-12);
}

/// The covariance of the vertical on the path: what the errors of path and gravity make, in the axes of the
/// reference.
[[nodiscard]] Matrix3<double> vertical_covariance(const InertialState& state) {
  const auto& x = std::get<0>(state.state);
  antipode::Matrix<double, 3, InertialChart::kDim> H =
      antipode::Matrix<double, 3, InertialChart::kDim>::Zero();
  H.middleCols<3>(StatePart::kPath) = -antipode::skew(Vector3<double>(x.vectors.col(0)));
  H.middleCols<3>(StatePart::kGamma) = x.pose.rotation_matrix();
  return H * state.covariance * H.transpose();
}

TEST_CASE("The vertical on the path does not change with motions, drifts and keyframes",
          "[inertial][fusion]") {
  std::mt19937_64 random(8);
  const InertialState state = random_state(random);
  const Matrix3<double> before = vertical_covariance(state);
  ReadMotion read = motion_of(Flight{});
  read.drift << normal3(random, 1e-3), normal3(random, 1e-2);
  CHECK(vertical_covariance(step(state, read).state).isApprox(before, 1e-9));
  const Matrix3<double> R = std::get<0>(state.state).pose.rotation_matrix();
  InertialState itself = relative_to_itself(state);
  const Matrix3<double> after = R * vertical_covariance(itself) * R.transpose();
  CHECK(after.isApprox(before, 1e-9));
  // And back, with an error of the pose that is new.
  const auto moved = at_pose(itself, measured(std::get<0>(state.state).pose, 1e-3, 1e-2, random));
  const Matrix3<double> R_moved = std::get<0>(moved.state).pose.rotation_matrix();
  const Matrix3<double> back = R_moved.transpose() * vertical_covariance(moved) * R_moved;
  CHECK(back.isApprox(vertical_covariance(itself), 1e-9));
}

TEST_CASE("A turn of the sensor changes the step as turned readings do, to first order",
          "[inertial][fusion]") {
  std::mt19937_64 random(6);
  const InertialState state = random_state(random);
  const Flight flight;
  for (int axis = 0; axis < 3; ++axis) {
    constexpr double kTurn_rad = 1e-3;
    const Vector3<double> turn = kTurn_rad * Vector3<double>::Unit(axis);
    const auto moved = InertialChart::local(step(state, motion_of(flight)).state.state,
                                            step(state, motion_of(flight, turn)).state.state);
    // The covariance of the step with the turn, for a state whose turn alone is uncertain, is the Jacobian.
    InertialState turned = state;
    turned.covariance.setZero();
    turned.covariance.block<3, 3>(StatePart::kTurn, StatePart::kTurn).setIdentity();
    const InertialStep with_turn = step(turned, motion_of(flight));
    const auto expected = kTurn_rad * with_turn.state.covariance.col(StatePart::kTurn + axis).head<12>();
    // The readings change by a tenth over the frame, and the mean stands for them.
    CHECK((moved.head<12>() - expected).norm() < 0.02 * expected.norm());
    CHECK(expected.norm() > 1e-5);
  }
}

TEST_CASE("A drift of the images turns and moves the pose, and not what the IMU feels",
          "[inertial][fusion]") {
  std::mt19937_64 random(7);
  const InertialState state = random_state(random);
  ReadMotion read = motion_of(Flight{});
  read.drift << normal3(random, 1e-3), normal3(random, 1e-3);
  InertialState drifting = state;
  std::get<5>(drifting.state) << normal3(random, 1.0), normal3(random, 1.0);
  const InertialStep without = step(state, read), with = step(drifting, read);
  const Vector6<double> drift = read.drift.cwiseProduct(std::get<5>(drifting.state));
  const Vector6<double> moved = with.T_previous_current().boxminus(without.T_previous_current());
  CHECK((moved - drift).norm() < 1e-2 * drift.norm());  // to first order in angles of milliradians
  const auto itself = [](const InertialStep& step) {
    return std::get<0>(relative_to_itself(step.state).state);
  };
  const double second_order = drift.squaredNorm();
  CHECK((itself(with).velocity - itself(without).velocity).norm() < 10.0 * second_order);
  CHECK((itself(with).vectors - itself(without).vectors).norm() < kGravity * second_order);
}

TEST_CASE("The covariance of a step has the drift as its mean has it", "[inertial][fusion]") {
  std::mt19937_64 random(8);
  InertialState state = random_state(random);
  ReadMotion read = motion_of(Flight{});
  read.drift << normal3(random, 1e-3), normal3(random, 1e-3);
  const InertialStep without = step(state, read);
  // The covariance of the step of a state whose drift alone is uncertain has the Jacobian as its columns.
  InertialState uncertain = state;
  uncertain.covariance.setZero();
  uncertain.covariance.block<6, 6>(StatePart::kDrift, StatePart::kDrift).setIdentity();
  const StateMatrix P = step(uncertain, read).state.covariance;
  for (int i = 0; i < 6; ++i) {
    InertialState drifting = state;
    std::get<5>(drifting.state) = Vector6<double>::Unit(i);
    const auto moved = InertialChart::local(without.state.state, step(drifting, read).state.state);
    const double kept = std::get<5>(step(drifting, read).state.state)[i];
    CHECK(kept < 1.0);
    const auto expected = P.col(StatePart::kDrift + i) / kept;
    CHECK((moved.head<12>() - expected.head<12>()).norm() < 1e-2 * expected.head<12>().norm());
    CHECK(std::abs(P(StatePart::kDrift + i, StatePart::kDrift + i) - 1.0) < 1e-12);  // stationary
  }
}

TEST_CASE("A state at a pose has the covariance that its parts have in the axes of the IMU", "[inertial]") {
  std::mt19937_64 random(4);
  const InertialState state = random_state(random);
  const InertialState itself = relative_to_itself(state);
  const PoseGaussian pose = measured(Pose::exp(Vector6<double>::Constant(0.3)), 1e-2, 1e-2, random);
  const InertialState again = relative_to_itself(at_pose(itself, pose));
  CHECK(again.covariance.isApprox(itself.covariance, 1e-9));
  CHECK((std::get<0>(again.state).velocity - std::get<0>(itself.state).velocity).norm() < 1e-12);
  CHECK((std::get<0>(again.state).vectors - std::get<0>(itself.state).vectors).norm() < 1e-12);
  const InertialEstimate estimate = estimate_of(itself);
  CHECK(estimate.covariance.block<9, 9>(3, 3) ==
        itself.covariance.block<9, 9>(StatePart::kGamma, StatePart::kGamma));
}

TEST_CASE("An unknown state is at rest without biases, whatever the memory held before", "[inertial]") {
  alignas(InertialState) std::array<unsigned char, sizeof(InertialState)> memory;
  memory.fill(0x55);
  const auto* state = new (memory.data()) InertialState(unknown_state());
  CHECK(std::get<1>(state->state) == antipode::Vector6<double>::Zero());
  CHECK(std::get<0>(state->state).velocity == Vector3<double>::Zero());
  CHECK(std::get<0>(state->state).vectors.norm() == 0.0);
  CHECK(std::get<0>(state->state).pose.is_approx(Pose::identity(), 0.0));
}

TEST_CASE("The known length of gravity tells the bias along it", "[inertial]") {
  InertialState state = unknown_state();
  std::get<0>(state.state).vectors = Vector3<double>(0.0, 0.0, -10.0);
  // An accelerometer at rest: gravity is known up to the bias, and to 1 mm/s^2 besides.
  for (int i = 0; i < 3; ++i) {
    const int g = StatePart::kGamma + i, b = StatePart::kAccel + i;
    state.covariance(g, b) = state.covariance(b, g) = state.covariance(b, b);
    state.covariance(g, g) = state.covariance(b, b) + 1e-6;
  }
  const InertialState known = with_known_gravity(state);
  const auto bias = std::get<1>(known.state);
  CHECK(std::get<0>(known.state).vectors.norm() == Approx(kGravity));
  CHECK(bias[5] == Approx(0.19).margin(0.01));        // the step of gravity along z, from -10 to -9.81
  CHECK(std::sqrt(known.covariance(17, 17)) < 0.04);  // the spread of gravity over the Earth
  CHECK(gravity_length(known).variance < 1e-12);
}
