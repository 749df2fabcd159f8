// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/excess_variance.hpp"

#include <cmath>
#include <random>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr double kMean = 0.3;

/// The excess variance of thirty measurements with noise of very different sizes, averaged over many such.
[[nodiscard]] Vector3<double> mean_estimate(const Vector3<double>& sigma) {
  constexpr int kRuns = 400, kMeasurements = 30;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> log_sigma(-1.7, -0.15);  // standard deviations of .02 to .7
  Vector3<double> sum = Vector3<double>::Zero();
  for (int run = 0; run < kRuns; ++run) {
    ExcessVariance excess;
    for (int i = 0; i < kMeasurements; ++i) {
      const double noise = std::pow(10.0, log_sigma(random));
      Vector3<double> value;
      for (int axis = 0; axis < 3; ++axis)
        value[axis] = kMean + sigma[axis] * normal(random) + noise * normal(random);
      excess.add(value, Vector3<double>::Constant(noise * noise));
    }
    sum += excess.value() / kRuns;
  }
  return sum;
}

TEST_CASE("The excess variance is that beyond the noise, whatever the mean", "[stereo_slam][rig]") {
  const Vector3<double> sigma(0.05, 0.3, 2.0);
  const Vector3<double> estimate = mean_estimate(sigma);
  // Thirty measurements tell a variance to sqrt(2 / 29) of itself where the noise is small, and four hundred
  // such estimates their mean to a hundredth. An estimate cannot be negative: those near zero are too large.
  CHECK(std::abs(estimate[0] / (sigma[0] * sigma[0]) - 1.0) < 0.2);
  CHECK(std::abs(estimate[1] / (sigma[1] * sigma[1]) - 1.0) < 0.07);
  CHECK(std::abs(estimate[2] / (sigma[2] * sigma[2]) - 1.0) < 0.06);
}

TEST_CASE("Measurements that are no further apart than their noise have no excess variance",
          "[stereo_slam][rig]") {
  const Vector3<double> estimate = mean_estimate(Vector3<double>::Zero());
  CHECK(estimate.maxCoeff() < 0.02 * 0.02);  // the smallest noise
}

TEST_CASE("One measurement tells no excess variance, and two tell it at once", "[stereo_slam][rig]") {
  ExcessVariance excess;
  CHECK(excess.value().isZero(0.0));
  const Vector3<double> noise = Vector3<double>::Constant(0.01);
  excess.add(Vector3<double>(5.0, 0.0, 0.0), noise);
  CHECK(excess.value().isZero(1e-12));
  excess.add(Vector3<double>(3.0, 0.05, 0.0), noise);
  // (5 - 3)^2 / 2, less the noise; of two measurements, five rounds leave a thirty-second.
  CHECK(std::abs(excess.value().x() - (2.0 - 0.01)) < 2.0 / 32.0);
  CHECK(excess.value().tail<2>().isZero(1e-12));
}

TEST_CASE("The last thirty measurements count", "[stereo_slam][rig]") {
  ExcessVariance excess;
  const Vector3<double> noise = Vector3<double>::Constant(0.01);
  for (int i = 0; i < 10; ++i) excess.add(Vector3<double>::Constant(i % 2 == 0 ? 3.0 : -3.0), noise);
  CHECK(excess.value().minCoeff() > 5.0);
  for (int i = 0; i < 30; ++i) excess.add(Vector3<double>::Constant(i % 2 == 0 ? 0.01 : -0.01), noise);
  CHECK(excess.value().isZero(1e-12));
}

}  // namespace
}  // namespace stereo_slam
