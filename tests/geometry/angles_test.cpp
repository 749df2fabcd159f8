// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <numbers>

#include <antipode/geometry/angles.hpp>

#include "support/catch.hpp"

namespace antipode::test {
namespace {

TEMPLATE_TEST_CASE("A wrapped angle is between -pi and pi and differs by full turns", "[angles]", float,
                   double) {
  using Scalar = TestType;
  constexpr Scalar kPi = std::numbers::pi_v<Scalar>, kTurn = 2 * kPi;
  for (const Scalar angle : {Scalar(0), Scalar(1e-8), Scalar(3), kPi, -kPi, Scalar(3.2), Scalar(-3.2), kTurn,
                             Scalar(100), Scalar(-12345)}) {
    CAPTURE(angle);
    const Scalar wrapped = wrap_angle(angle);
    CHECK(std::abs(wrapped) <= kPi);
    const Scalar turns = (angle - wrapped) / kTurn;
    CHECK(std::abs(turns - std::round(turns)) <=
          4 * std::numeric_limits<Scalar>::epsilon() * (1 + std::abs(turns)));
  }
  CHECK(wrap_angle(Scalar(3)) == Scalar(3));
}

TEMPLATE_TEST_CASE("angle_near() is within half a turn of the reference, however far that is", "[angles]",
                   float, double) {
  using Scalar = TestType;
  const Scalar eps = 32 * std::numeric_limits<Scalar>::epsilon();
  for (const Scalar reference : {Scalar(-3.1), Scalar(0), Scalar(3.1), Scalar(20)}) {
    for (Scalar offset = Scalar(-3); offset <= Scalar(3); offset += Scalar(0.75)) {
      const Scalar angle = std::atan2(std::sin(reference + offset), std::cos(reference + offset));
      CHECK(std::abs(angle_near(reference, angle) - (reference + offset)) < eps);
    }
  }
}

TEST_CASE("Angles that are not finite stay visible", "[angles]") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  CHECK(std::isnan(wrap_angle(nan)));
  CHECK(std::isnan(wrap_angle(inf)));
  CHECK(std::isnan(angle_near(0.0, nan)));
  CHECK(std::isnan(angle_near(nan, 0.0)));
  CHECK(std::isnan(angle_near(0.0, -inf)));
}

}  // namespace
}  // namespace antipode::test
