// SPDX-License-Identifier: MIT
//
// A joint state: pose, velocity and the biases of an inertial measurement unit, followed by gyroscope and
// accelerometer at 100 Hz and a position fix every second. A hundred simulated flights of a minute each tell
// whether the covariance is as large as the error.
//
//   state           navigation = (R, v, p) of T_world_body, an element of SE_2(3), and the biases
//                   (gyroscope [rad/s], accelerometer [m/s^2]); its chart is composed of those of the parts:
//                   xi = (phi, nu, rho) of x exp(xi), and the difference of the biases
//
//   w, a            measured angular velocity and specific force, in the axes of the body
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <numbers>
#include <random>
#include <tuple>
#include <vector>

#include <antipode/filters/pose_filter.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/extended_pose.hpp>

using Navigation = antipode::ExtendedPose<double>;
using Chart = antipode::ProductChart<antipode::ExtendedPoseChart<double>, antipode::VectorChart<double, 6>>;
using Filter = antipode::StateFilter<Chart>;
using State = Chart::Point;
using Tangent = antipode::Vector<double, 15>;
using Covariance = antipode::Matrix<double, 15>;
using Vector3 = antipode::Vector3<double>;
using Matrix3 = antipode::Matrix3<double>;

namespace {

constexpr double kStep_s = 0.01;
const Vector3 kGravity(0, 0, -9.81);
constexpr double kGyroNoise = 1e-3;      // rad/s/sqrt(Hz)
constexpr double kAccelNoise = 1e-2;     // m/s^2/sqrt(Hz)
constexpr double kGyroBiasWalk = 1e-5;   // rad/s^2/sqrt(Hz)
constexpr double kAccelBiasWalk = 1e-4;  // m/s^3/sqrt(Hz)
constexpr double kPositionSigma_m = 0.3;

struct ImuReading {
  Vector3 w, a;
};

// What the readings add to the navigation state in one step, in the axes of the body: R(w dt), a dt, a
// dt^2/2.
Navigation increment(const ImuReading& imu, const antipode::Vector<double, 6>& biases) {
  antipode::Vector6<double> step;
  step << (imu.w - biases.head<3>()) * kStep_s, Vector3::Zero();
  const Vector3 dv = (imu.a - biases.tail<3>()) * kStep_s;
  const auto rotation = antipode::DualQuaternion<double>::exp(step).rotation();
  return {antipode::DualQuaternion<double>::from_rotation_translation(rotation, Vector3(0.5 * kStep_s * dv)),
          dv};
}

// x <- gravity * (x, carried along by its velocity) * increment: an affine map of the group.
State propagate(const State& state, const ImuReading& imu) {
  const auto& [x, biases] = state;
  const Navigation carried{antipode::DualQuaternion<double>::from_rotation_translation(
                               x.pose.rotation(), Vector3(x.pose.translation() + kStep_s * x.velocity +
                                                          0.5 * kStep_s * kStep_s * kGravity)),
                           x.velocity + kStep_s * kGravity};
  return {carried * increment(imu, biases), biases};
}

// Its Jacobian: Ad(increment^-1) times the transport of position by velocity, and the slopes of the biases.
Covariance jacobian(const State& state, const ImuReading& imu) {
  const auto step = increment(imu, std::get<1>(state));
  antipode::Matrix<double, 9> carry = antipode::Matrix<double, 9>::Identity();
  carry.block<3, 3>(6, 3) = kStep_s * Matrix3::Identity();
  Covariance F = Covariance::Identity();
  F.topLeftCorner<9, 9>() = step.inverse().adjoint() * carry;
  const Matrix3 back = step.pose.rotation_matrix().transpose();
  F.block<3, 3>(0, 9) = -kStep_s * Matrix3::Identity();
  F.block<3, 3>(3, 12) = -kStep_s * back;
  F.block<3, 3>(6, 12) = -0.5 * kStep_s * kStep_s * back;
  return F;
}

// White noise over one step.
Covariance process_noise() {
  Covariance Q = Covariance::Zero();
  const Matrix3 I = Matrix3::Identity();
  const double q_v = kAccelNoise * kAccelNoise * kStep_s;
  Q.block<3, 3>(0, 0) = kGyroNoise * kGyroNoise * kStep_s * I;
  Q.block<3, 3>(3, 3) = q_v * I;
  Q.block<3, 3>(3, 6) = Q.block<3, 3>(6, 3) = q_v * kStep_s / 2 * I;
  Q.block<3, 3>(6, 6) = q_v * kStep_s * kStep_s / 3 * I;
  Q.block<3, 3>(9, 9) = kGyroBiasWalk * kGyroBiasWalk * kStep_s * I;
  Q.block<3, 3>(12, 12) = kAccelBiasWalk * kAccelBiasWalk * kStep_s * I;
  return Q;
}

// A root of it: what the simulation multiplies with draws of N(0, I).
Covariance root_of(const Covariance& P) { return antipode::detail::cholesky_factor<double, 15>(P).value(); }

// A turning, climbing flight: what the sensors read without noise.
ImuReading reading(double t_s) {
  return {{0.1 * std::sin(0.5 * t_s), 0.05 * std::cos(0.3 * t_s), 0.2},
          {1.5 * std::sin(0.4 * t_s), 1.0, 9.81 + 0.3 * std::cos(0.7 * t_s)}};
}

// One minute; the NEES at its end. The squared position error is added to the sum.
double fly(unsigned seed, double& squared_position_error) {
  constexpr int kSteps = 6000, kStepsPerFix = 100;
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&] {
    Tangent g;
    for (double& entry : g) entry = normal(rng);
    return g;
  };
  Tangent start_sigma;
  start_sigma << Vector3::Constant(5 * std::numbers::pi / 180), Vector3::Constant(0.5),
      Vector3::Constant(1.0), Vector3::Constant(2e-3), Vector3::Constant(0.05);
  const Covariance P = start_sigma.cwiseAbs2().asDiagonal();
  const Covariance Q = process_noise();
  const Covariance Q_root = root_of(Q);

  const State start{Navigation{}, antipode::Vector<double, 6>::Zero()};
  State truth = Chart::retract(start, start_sigma.cwiseProduct(draw()));
  Filter filter({start, P});
  for (int k = 1; k <= kSteps; ++k) {
    const ImuReading imu = reading(k * kStep_s);
    truth = Chart::normalized(Chart::retract(propagate(truth, imu), Q_root * draw()));
    const Covariance F = jacobian(filter.density().state, imu);
    filter.predict([&](const State& x) { return propagate(x, imu); }, F, Q);
    if (k % kStepsPerFix != 0) continue;
    const Vector3 fix = std::get<0>(truth).pose.translation() + kPositionSigma_m * draw().head<3>();
    filter.update(antipode::GaussianMeasurements(
        std::vector<antipode::NoisyMeasurement<double, 3>>{
            {fix, kPositionSigma_m * kPositionSigma_m * Matrix3::Identity()}},
        [](const State& x, std::size_t) -> Vector3 { return std::get<0>(x).pose.translation(); }));
  }
  squared_position_error +=
      (std::get<0>(filter.density().state).pose.translation() - std::get<0>(truth).pose.translation())
          .squaredNorm();
  return nees(filter.density(), truth);
}

void expect(bool holds, const char* what) {
  if (!holds) {
    std::cerr << "unexpected: " << what << '\n';
    std::exit(EXIT_FAILURE);
  }
}

}  // namespace

int main() {
  constexpr int kFlights = 100;
  double sum = 0.0, squared_position_error = 0.0;
  for (unsigned seed = 0; seed < kFlights; ++seed) sum += fly(seed, squared_position_error);
  const double anees = sum / kFlights;
  const double band = 1.96 * std::sqrt(30.0 / kFlights);  // of the mean of 100 chi-squares with 15 degrees
  const double position_rmse = std::sqrt(squared_position_error / kFlights);
  std::cout << "ANEES of " << kFlights << " flights: " << anees << ", 15 +- " << band
            << " if the covariance is right\nposition after a minute: " << position_rmse << " m RMSE\n";
  expect(std::abs(anees - 15.0) < band, "the covariance matches the error");
  expect(position_rmse < 0.4, "the position is known to a few decimetres");
}
