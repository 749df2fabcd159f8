// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/sensors/inertial_propagation.hpp>

#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/core/inertial_estimate.hpp"
#include "stereo_slam/core/types.hpp"

/// @file
/// The state of the inertial filter: pose T_reference_imu, velocity and gravity in the axes of the reference,
/// the biases, the turn of the sensor, the delay of its stamps, its offset, the drift of the images, and the
/// error of the path, 34 dimensions (docs/guides/inertial.md). The reference is a keyframe's IMU, or the IMU
/// itself at the frame.
///
/// The axes of the IMU are those of the calibration, fixed to the camera. Those in which it reads are turned
/// by what is wrong with the calibration: a reading x is Exp(turn) x in the axes of the IMU. Likewise the
/// IMU, whose pose, velocity and biases these are, is where the calibration has it, and reads at the point
/// `offset` in its axes.
///
/// The state is that at the time of an image with the stamp t. Samples with the stamp t + delay are those of
/// this time.
///
/// The drift is what the motions that the images show have wrong in common for seconds, in standard
/// deviations (ReadMotion::drift). The pose is the one that the images show, with this error; velocity and
/// gravity in the axes of the IMU are the true ones.
///
/// The error of the path is how far the reference is turned, in the axes of its IMU, from where the path over
/// the keyframes has it, relative to the first one. No reading depends on it. It is known through what the
/// errors of the path have in common with those of gravity: the errors of the poses are in both, and the
/// vertical in the axes of the first keyframe, which they make, never becomes less certain.
namespace stereo_slam {

using InertialChart = antipode::InertialChart<double, antipode::VectorChart<double, 3>,  // turn, rad
                                              antipode::VectorChart<double, 1>,          // delay, s
                                              antipode::VectorChart<double, 3>,          // offset, m
                                              antipode::VectorChart<double, 6>,          // drift
                                              antipode::VectorChart<double, 3>>;         // path, rad
using InertialState = antipode::StateGaussian<InertialChart>;
using InertialMotion = antipode::InertialMotion<double>;
using StateMatrix = antipode::Matrix<double, InertialChart::kDim>;
using StateByPose = antipode::Matrix<double, InertialChart::kDim, 6>;

/// The first coordinates of the parts of a tangent vector (phi, nu, rho, gamma, b_g, b_a, turn, delay,
/// offset, drift, path).
struct StatePart {
  static constexpr int kPhi = 0, kNu = 3, kRho = 6, kGamma = 9, kGyro = 12, kAccel = 15, kTurn = 18,
                       kDelay = 21, kOffset = 22, kDrift = 25, kPath = 31;
};

/// The motion by the readings of an IMU, and what it depends on besides the state at its beginning.
struct ReadMotion {
  InertialMotion motion;
  /// Means of the readings over its time, in the axes of the IMU: rate and specific force. How a turn of the
  /// sensor changes the motion follows from them.
  Vector6<double> mean = Vector6<double>::Zero();
  /// How a longer delay changes the motion, per second: InertialMotion::derivative_by_shift().
  antipode::Vector<double, 12> by_delay = antipode::Vector<double, 12>::Zero();
  /// How an offset of the sensor changes velocity and position at the end, in the axes there: d (nu, rho) / d
  /// offset.
  antipode::Matrix<double, 6, 3> by_offset = antipode::Matrix<double, 6, 3>::Zero();
  /// The variance that the noise of the readings leaves in the first six numbers of `by_delay`.
  Vector6<double> by_delay_variance = Vector6<double>::Zero();
  /// What the images' motion has more than the true one, per unit of drift: angles and lengths in the axes of
  /// the IMU.
  Vector6<double> drift = Vector6<double>::Zero();
};

inline constexpr double kGravity = 9.81;  ///< m/s^2; it differs by .03 from place to place

/// A state of which nothing is known but that its pose is the reference: up to 20 m/s in any direction,
/// gravity in any direction, usual biases, turn and offset that a good calibration leaves, a delay with this
/// standard deviation, and any drift.
[[nodiscard]] InertialState unknown_state(double delay_sigma_s = kUnknownDelaySigma_s);

/// The state relative to the IMU itself, whose pose is then the reference.
[[nodiscard]] InertialState relative_to_itself(const InertialState& state);

/// A state relative to the IMU itself, moved to the pose T_reference_imu, whose error is independent.
[[nodiscard]] InertialState at_pose(const InertialState& itself, const PoseGaussian& T_reference_imu);

/// The state with an error of the path that is independent of the rest, in the axes of the reference.
[[nodiscard]] InertialState with_path_error(const InertialState& state, const Matrix3<double>& covariance);

/// A state relative to the IMU itself that knows its gravity and biases, but not its velocity: as after a
/// time without samples.
[[nodiscard]] InertialState without_velocity(const InertialState& itself);

/// The state relative to another frame fixed to the same body: `T_b_a` X T_b_a^-1 for poses X.
[[nodiscard]] PoseGaussian conjugated(const Pose& T_b_a, const PoseGaussian& X);

/// What is reported of a state that is relative to the IMU itself.
[[nodiscard]] InertialEstimate estimate_of(const InertialState& itself);

/// The length of gravity, with its variance as the state has it.
struct GravityLength {
  double length = 0.0;
  double variance = 0.0;
};
[[nodiscard]] GravityLength gravity_length(const InertialState& state);

/// The state with a gravity of 9.81 m/s^2 exactly: what the known length tells of the rest, the bias of the
/// accelerometer above all, is taken over.
[[nodiscard]] InertialState with_known_gravity(const InertialState& state);

}  // namespace stereo_slam
