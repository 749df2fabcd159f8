// SPDX-License-Identifier: MIT
//
// A pose filter in a dozen lines. A drone flies a circle among known beacons. Its odometry drifts, and after
// every step it hears how far away the beacons are. Where is it, and how well does it know?
//
//   T_world_drone   the pose that is estimated, as a PoseGaussian: its mean, and the covariance of a small
//                   motion (rotation [rad], translation [m]) in the drone's own frame
//
//   T_before_now    one step by the odometry: maps coordinates after it to coordinates before it
//
//   range_m         distance from a beacon to the antenna, which sticks out of the drone, so that ranges
//                   tell of its attitude, too
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <numbers>
#include <random>
#include <vector>

#include <antipode/antipode.hpp>

using Pose = antipode::DualQuaternion<double>;
using Belief = antipode::PoseGaussian<double>;
using Point = antipode::Vector3<double>;
using Twist = antipode::Vector6<double>;

namespace {

constexpr double kRangeSigma_m = 0.05;
const Point kAntenna_drone(2.0, 0.5, 1.0);
const std::vector<Point> kBeacons_world{{20, 0, 0},  {-20, 5, 3},  {0, 20, 8},
                                        {5, -20, 1}, {-8, -8, 15}, {12, 12, 10}};

double range_m(const Pose& T_world_drone, const Point& beacon_world) {
  return (T_world_drone * kAntenna_drone - beacon_world).norm();
}

// The filter. A measurement is anything that has a log-likelihood; no derivatives are needed.
struct PoseFilter {
  Belief belief;

  void predict(const Pose& T_before_now, const antipode::Matrix6<double>& noise) {
    belief = antipode::predict_closed_form(belief, T_before_now, {Pose::identity(), noise});
  }

  antipode::UpdateStatus update(const std::vector<double>& ranges_m) {
    const auto log_likelihood = [&](const Pose& T_world_drone) {
      double sum = 0.0;
      for (std::size_t i = 0; i < ranges_m.size(); ++i) {
        sum -= 0.5 * std::pow((ranges_m[i] - range_m(T_world_drone, kBeacons_world[i])) / kRangeSigma_m, 2);
      }
      return sum;
    };
    const auto result = antipode::quadratic_update(belief, log_likelihood);
    belief = result.posterior;
    return result.status;
  }
};

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
  const antipode::Matrix6<double> step_noise = step_sigma.cwiseAbs2().asDiagonal();

  Pose truth = Pose::from_rotation_translation(antipode::Vector4<double>(1, 0, 0, 0), Point(0, -10, 5));
  PoseFilter filter{{truth.boxplus(draw(start_sigma)), start_sigma.cwiseAbs2().asDiagonal()}};
  Belief odometry_only = filter.belief;

  double squared_error_sum = 0.0;
  constexpr int kSteps = 200;
  for (int k = 0; k < kSteps; ++k) {
    truth = truth * Pose::exp(step);
    const Pose measured = Pose::exp(step).boxplus(draw(step_sigma));
    filter.predict(measured, step_noise);
    odometry_only = antipode::predict_closed_form(odometry_only, measured, {Pose::identity(), step_noise});

    std::vector<double> ranges_m;
    for (const Point& beacon : kBeacons_world) {
      ranges_m.push_back(range_m(truth, beacon) + kRangeSigma_m * normal(rng));
    }
    expect(filter.update(ranges_m) == antipode::UpdateStatus::kConverged, "an update converges");

    const Twist error = truth.boxminus(filter.belief.pose);
    squared_error_sum += error.dot(filter.belief.covariance.ldlt().solve(error));
  }

  const double position_error = (truth.translation() - filter.belief.pose.translation()).norm();
  const double odometry_error = (truth.translation() - odometry_only.pose.translation()).norm();
  const double honesty = squared_error_sum / (6 * kSteps);
  std::cout << "position error after " << kSteps << " m: " << position_error << " m, by odometry alone "
            << odometry_error << " m\nsquared error over predicted variance: " << honesty
            << " (1 is honest)\n";
  expect(position_error < 0.15, "the position is known to a few centimetres");
  expect(odometry_error > 5 * position_error, "the odometry drifts");
  expect(honesty > 0.6 && honesty < 1.6, "the covariance is as large as the error");
}
