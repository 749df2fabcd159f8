// SPDX-License-Identifier: MIT
#include <limits>
#include <stdexcept>

#include <antipode/sensors/inertial_measurement_unit.hpp>

#include "support/catch.hpp"

namespace antipode {
namespace {

TEMPLATE_TEST_CASE("A sample of an IMU is finite if all six of its numbers are", "[imu]", float, double) {
  using Scalar = TestType;
  ImuSample<Scalar> sample{5, {0.1, -0.2, 0.3}, {0, 0, 9.81}};
  CHECK(sample.finite());
  for (const Scalar bad :
       {std::numeric_limits<Scalar>::quiet_NaN(), std::numeric_limits<Scalar>::infinity()}) {
    for (int axis = 0; axis < 3; ++axis) {
      ImuSample<Scalar> turning = sample, moving = sample;
      turning.angular_velocity[axis] = bad;
      moving.specific_force[axis] = -bad;
      CHECK_FALSE(turning.finite());
      CHECK_FALSE(moving.finite());
    }
  }
}

TEST_CASE("The noise of an IMU has four densities that are finite and not negative", "[imu]") {
  using Noise = ImuNoise<double>;
  CHECK_NOTHROW(Noise{}.check());
  CHECK_NOTHROW(Noise{1e-4, 2e-3, 2e-5, 3e-3}.check());
  for (const double bad :
       {-1e-9, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (double Noise::*density : {&Noise::gyroscope, &Noise::accelerometer, &Noise::gyroscope_bias_walk,
                                   &Noise::accelerometer_bias_walk}) {
      Noise noise{1e-4, 2e-3, 2e-5, 3e-3};
      noise.*density = bad;
      CHECK_THROWS_AS(noise.check(), std::invalid_argument);
    }
  }
}

}  // namespace
}  // namespace antipode
