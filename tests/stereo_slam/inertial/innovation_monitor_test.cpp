// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/innovation_monitor.hpp"

#include <random>

#include "stereo_slam/inertial/noise_in_motion.hpp"
#include "stereo_slam/support/flight.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Innovations of a right filter are no contradiction, and those five times as large are",
          "[inertial]") {
  std::mt19937_64 random(1);
  std::chi_squared_distribution<double> chi2(6.0);
  InnovationMonitor right, wrong;
  for (int i = 0; i < 1000; ++i) {
    right.add(chi2(random), false);
    CHECK_FALSE(right.contradicts());
  }
  for (int i = 0; i < 30; ++i) wrong.add(5.0 * chi2(random), false);
  CHECK(wrong.contradicts());
  CHECK(right.mean() == Approx(6.0).margin(3.3 * std::sqrt(12.0 / 30.0)));
}

TEST_CASE("Few innovations decide only if they are impossible three times in a row", "[inertial]") {
  const double impossible = 2.0 * InnovationMonitor::kImpossible;
  InnovationMonitor monitor;
  for (int i = 0; i < 9; ++i) monitor.add(90.0, false);
  CHECK_FALSE(monitor.contradicts());
  monitor = {};
  for (int i = 0; i < 2; ++i) monitor.add(impossible, false);
  CHECK_FALSE(monitor.contradicts());
  monitor.add(impossible, false);
  CHECK(monitor.contradicts());
}

TEST_CASE("A motion that other measurements refute says nothing against the filter", "[inertial]") {
  InnovationMonitor monitor;
  for (int i = 0; i < 100; ++i) monitor.add(2.0 * InnovationMonitor::kImpossible, true);
  CHECK_FALSE(monitor.contradicts());
  CHECK(monitor.mean() == 0.0);
}

TEST_CASE("The noise of an IMU is what its samples shake by, and never less than at rest", "[inertial]") {
  std::mt19937_64 random(2);
  const ImuNoise at_rest{2e-4, 2e-3, 2e-5, 3e-3};
  const Flight flight;
  NoiseInMotion quiet, shaken;
  for (int i = 0; i < 400; ++i) {
    ImuSample sample = flight.reading(i * kSample_ns);
    quiet.add(sample);
    sample.specific_force += normal3(random, 0.5);  // m/s^2, as rotors do
    shaken.add(sample);
  }
  CHECK(quiet.densities(at_rest).gyroscope == at_rest.gyroscope);
  CHECK(quiet.densities(at_rest).accelerometer == at_rest.accelerometer);
  // A sample's deviation is the density times the root of the rate. Doubled, as vibrations are no white
  // noise. 1200 numbers, of which each enters three differences: the root mean square is known to 4 %.
  CHECK(shaken.densities(at_rest).accelerometer == Approx(2.0 * 0.5 / std::sqrt(200.0)).epsilon(0.13));
  CHECK(shaken.densities(at_rest).accelerometer_bias_walk == at_rest.accelerometer_bias_walk);
}
