// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/noise_scale.hpp"

#include <limits>
#include <random>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("The noise scale converges to the variance of the noise and follows it", "[stereo_slam][slam]") {
  NoiseScale noise;
  CHECK(noise.variance_ratio() == 1.0);
  std::mt19937_64 random(1);
  constexpr int kDof = 300;
  const auto add_updates = [&](double variance, int count) {
    std::chi_squared_distribution<double> nis(kDof);
    for (int i = 0; i < count; ++i) noise.add(variance * nis(random), kDof);
  };
  add_updates(0.4, 1);
  CHECK(noise.variance_ratio() > 0.8);  // one update hardly counts
  add_updates(0.4, 300);
  CHECK(noise.variance_ratio() == Approx(0.4).epsilon(0.1));
  add_updates(3.0, 300);
  CHECK(noise.variance_ratio() == Approx(3.0).epsilon(0.1));
}

TEST_CASE("The noise scale ignores updates without measurements, and stays above zero",
          "[stereo_slam][slam]") {
  NoiseScale noise;
  noise.add(5.0, 0);
  noise.add(std::numeric_limits<double>::quiet_NaN(), 3);
  noise.add(std::numeric_limits<double>::infinity(), 3);
  CHECK(noise.variance_ratio() == 1.0);
  for (int i = 0; i < 1000; ++i) noise.add(0.0, 300);
  CHECK(noise.variance_ratio() >= 0.1);
}

}  // namespace
}  // namespace stereo_slam
