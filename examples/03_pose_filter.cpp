// SPDX-License-Identifier: MIT
//
// A pose filter in a dozen lines. A drone flies a circle among known beacons. Its odometry drifts, and after
// every step it measures the distances to the beacons. Where is it, and with which uncertainty?
//
//   T_world_drone   the pose that is estimated, as a PoseGaussian: its mean, and the covariance of a small
//                   motion (rotation [rad], translation [m]) in the drone's own frame
//
//   T_before_now    one step by the odometry: maps coordinates after it to coordinates before it
//
//   range_m         distance from a beacon to the antenna, which sticks out of the drone, so that ranges
//                   depend on its attitude, too
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Cholesky>

#include <antipode/antipode.hpp>

using Pose = antipode::DualQuaternion<double>;
using Belief = antipode::PoseGaussian<double>;
using Point = antipode::Vector3<double>;
using Twist = antipode::Vector6<double>;
using Scalar = antipode::Vector<double, 1>;

namespace {

constexpr double kRangeSigma_m = 0.05;
const Point kAntenna_drone(2.0, 0.5, 1.0);
const std::vector<Point> kBeacons_world{{20, 0, 0},  {-20, 5, 3},  {0, 20, 8},
                                        {5, -20, 1}, {-8, -8, 15}, {12, 12, 10}};

double range_m(const Pose& T_world_drone, const Point& beacon_world) {
  return (T_world_drone * kAntenna_drone - beacon_world).norm();
}

// The measured ranges and their model. No derivatives are needed.
auto measurement_of(const std::vector<double>& ranges_m) {
  std::vector<antipode::NoisyMeasurement<double, 1>> measured;
  measured.reserve(ranges_m.size());
  for (const double range : ranges_m) {
    measured.push_back({Scalar(range), Scalar(kRangeSigma_m * kRangeSigma_m)});
  }
  return antipode::GaussianMeasurements(measured, [](const Pose& T_world_drone, std::size_t beacon) {
    return Scalar(range_m(T_world_drone, kBeacons_world[beacon]));
  });
}

// A filter is a density, a sigma point rule and an update. This one takes any log-likelihood; the measurement
// above is one. Others are named beside it (filters/pose_filter.hpp): the paper's is PaperPoseFilter.
using Filter = antipode::QuadraticPoseFilter<double>;
using LinearizedFilter = antipode::LinearizedPoseFilter<double>;

void expect(bool holds, const char* what) {
  if (!holds) {
    std::cerr << "unexpected: " << what << '\n';
    std::exit(EXIT_FAILURE);
  }
}

}  // namespace

int main() {
  std::mt19937 rng(1);
  std::normal_distribution<double> normal;
  const auto draw = [&](const Twist& sigma) -> Twist {
    Twist xi;
    for (int i = 0; i < 6; ++i) xi[i] = sigma[i] * normal(rng);
    return xi;
  };

  // Each step: one metre ahead and 6 degrees to the left, measured to 0.3 degrees and 3 cm.
  Twist step, step_sigma, start_sigma;
  step << 0, 0, 6 * std::numbers::pi / 180, 1, 0, 0.02;
  step_sigma << Point::Constant(0.3 * std::numbers::pi / 180), Point::Constant(0.03);
  start_sigma << Point::Constant(5 * std::numbers::pi / 180), Point::Constant(0.5);

  Pose truth = Pose::from_rotation_translation(antipode::Vector4<double>(1, 0, 0, 0), Point(0, -10, 5));
  const Belief start{truth.boxplus(draw(start_sigma)), start_sigma.cwiseAbs2().asDiagonal()};
  const Belief noise{Pose::identity(), step_sigma.cwiseAbs2().asDiagonal()};
  Filter filter(start);
  LinearizedFilter linearized(start);
  Belief odometry_only = start;

  double squared_error_sum = 0.0, largest_difference_sigmas = 0.0;
  constexpr int kSteps = 200;
  for (int k = 0; k < kSteps; ++k) {
    truth = truth * Pose::exp(step);
    const Pose measured = Pose::exp(step).boxplus(draw(step_sigma));
    filter.predict(measured, noise);
    linearized.predict(measured, noise);
    odometry_only = antipode::predict_closed_form(odometry_only, measured, noise);

    std::vector<double> ranges_m;
    ranges_m.reserve(kBeacons_world.size());
    for (const Point& beacon : kBeacons_world) {
      ranges_m.push_back(range_m(truth, beacon) + kRangeSigma_m * normal(rng));
    }
    const auto measurement = measurement_of(ranges_m);
    expect(filter.update(measurement).status == antipode::UpdateStatus::kConverged, "an update converges");
    expect(linearized.update(measurement).status == antipode::UpdateStatus::kConverged, "so does the other");

    const auto in_sigmas = [&](const Pose& other) {
      const Twist error = other.boxminus(filter.belief().pose);
      return std::sqrt(error.dot(filter.belief().covariance.ldlt().solve(error)));
    };
    squared_error_sum += std::pow(in_sigmas(truth), 2);
    largest_difference_sigmas = std::max(largest_difference_sigmas, in_sigmas(linearized.belief().pose));
  }

  const double position_error = (truth.translation() - filter.belief().pose.translation()).norm();
  const double odometry_error = (truth.translation() - odometry_only.pose.translation()).norm();
  const double error_ratio = squared_error_sum / (6 * kSteps);
  std::cout << "position error after " << kSteps << " m: " << position_error << " m, by odometry alone "
            << odometry_error << " m\nsquared error over predicted variance: " << error_ratio
            << " (1 is consistent)\nthe two filters differ by at most " << largest_difference_sigmas
            << " standard deviations\n";
  expect(position_error < 0.15, "the position is known to a few centimetres");
  expect(odometry_error > 5 * position_error, "the odometry drifts");
  expect(largest_difference_sigmas < 0.5, "the two filters agree");
  expect(error_ratio > 0.6 && error_ratio < 1.6, "the covariance matches the error");
}
