// SPDX-License-Identifier: MIT
#include <limits>

#include <antipode/filters/robust_noise.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

TEMPLATE_TEST_CASE("The weight is the slope of the log-density, and weight_slope that of the weight",
                   "[robust][law]", NormalNoise<double>, TruncatedLoss<double>, CauchyLoss<double>,
                   StudentT<double>, Contamination<double>) {
  const TestType noise{};
  const int dim = GENERATE(1, 2, 3, 6);
  for (const double d2 : {0.01, 0.5, 2.0, 9.0, 30.0, 200.0}) {
    CAPTURE(dim, d2);
    const double h = 1e-4 * d2;
    const double slope = (noise.log_density(d2 + h, dim) - noise.log_density(d2 - h, dim)) / (2 * h);
    CHECK(noise.weight(d2, dim) == Approx(-2.0 * slope).epsilon(1e-6).margin(1e-12));
    const double change = (noise.weight(d2 + h, dim) - noise.weight(d2 - h, dim)) / (2 * h);
    CHECK(noise.weight_slope(d2, dim) == Approx(change).epsilon(1e-5).margin(1e-12));
  }
  CHECK(noise.weight(0.0, dim) >= noise.weight(1e6, dim));
}

TEMPLATE_TEST_CASE("Log-density and weight are numbers at any distance", "[robust]", NormalNoise<double>,
                   TruncatedLoss<double>, CauchyLoss<double>, StudentT<double>, Contamination<double>) {
  const TestType noise{};
  CHECK_NOTHROW(noise.check());
  for (const double d2 : {0.0, 1e-300, 1.0, 1e300}) {
    CAPTURE(d2);
    CHECK(noise.log_density(d2, 3) <= noise.log_density(0.0, 3));
    CHECK(noise.log_density(d2, 3) > -std::numeric_limits<double>::infinity());
    CHECK(noise.weight(d2, 3) >= 0.0);
    CHECK(noise.weight(d2, 3) < 10.0);
  }
}

TEST_CASE("A loss without a scale is refused", "[robust]") {
  for (const double scale : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK(contains(error_message([&] { CauchyLoss<double>{scale}.check(); }), "scale of CauchyLoss"));
    CHECK(contains(error_message([&] { TruncatedLoss<double>{scale}.check(); }), "cap of TruncatedLoss"));
  }
}
