// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <antipode/distributions/bingham_normalizer.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"
#include "support/csv.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

template <int Dim>
void check_against_reference(const std::string& file) {
  for (const auto& row : read_csv(file)) {
    REQUIRE(row.size() == 2 * Dim + 1);
    const Vector<double, Dim> z = Eigen::Map<const Vector<double, Dim>>(row.data());
    const Vector<double, Dim> gradient = Eigen::Map<const Vector<double, Dim>>(row.data() + Dim + 1);
    CAPTURE(z.transpose());
    const auto n = bingham_normalizer(z);
    CHECK(std::abs(n.log_normalizer - row[Dim]) <= 1e-12);
    CHECK(max_relative_difference(n.second_moments, gradient) <= 1e-12);
    CHECK(bingham_log_normalizer(z) == n.log_normalizer);
  }
}

/// Calls f(z) for random z of dimension 2 to 8, over sixteen decades.
template <class Scalar, class Function>
void for_random_concentrations(const Function& f) {
  const auto run = [&]<int... kDims>(std::integer_sequence<int, kDims...>) {
    for (unsigned seed = 0; seed < 40; ++seed) {
      CAPTURE(seed);
      Rng rng(seed);
      (f(random_concentrations<Scalar, kDims + 2>(rng, -4.0, seed % 2 ? 2.0 : 12.0)), ...);
    }
  };
  run(std::make_integer_sequence<int, 7>());
}

}  // namespace

TEST_CASE("The normaliser and its gradient agree with 35-digit values in dimension 2", "[bingham][oracle]") {
  check_against_reference<2>("bingham_norm_s1.csv");
}
TEST_CASE("The normaliser and its gradient agree with 35-digit values in dimension 3", "[bingham][oracle]") {
  check_against_reference<3>("bingham_norm_s2.csv");
}
TEST_CASE("The normaliser and its gradient agree with 35-digit values in dimension 4", "[bingham][oracle]") {
  check_against_reference<4>("bingham_norm_s3.csv");
}
TEST_CASE("The normaliser and its gradient agree with 35-digit values in dimension 6", "[bingham][oracle]") {
  check_against_reference<6>("bingham_norm_s5.csv");
}

TEST_CASE("Fourth moments agree with 35-digit values", "[bingham][oracle]") {
  for (const auto& row : read_csv("bingham_hess_s3.csv")) {
    const Vector4<double> z(row[0], row[1], row[2], row[3]);
    CAPTURE(z.transpose());
    const auto n = bingham_normalizer_hessian(z);
    std::size_t column = 4;
    for (int i = 0; i < 4; ++i) {
      for (int j = i; j < 4; ++j) {
        CHECK(std::abs(n.fourth_moments(i, j) / row[column++] - 1.0) <= 1e-12);
        CHECK(n.fourth_moments(j, i) == n.fourth_moments(i, j));
      }
    }
  }
}

TEST_CASE("The uniform density has the area of the sphere as its normaliser", "[bingham]") {
  const auto check = []<int Dim>(std::integral_constant<int, Dim>) {
    const auto n = bingham_normalizer(Vector<double, Dim>::Zero().eval());
    const double area = std::log(2.0) + 0.5 * Dim * std::log(std::numbers::pi) - std::lgamma(0.5 * Dim);
    CHECK(std::abs(n.log_normalizer - area) <= 1e-13);
    CHECK(max_difference(n.second_moments, Vector<double, Dim>::Constant(1.0 / Dim)) <= 1e-12);
  };
  check(std::integral_constant<int, 2>());
  check(std::integral_constant<int, 3>());
  check(std::integral_constant<int, 4>());
  check(std::integral_constant<int, 5>());
  check(std::integral_constant<int, 6>());
  check(std::integral_constant<int, 7>());
  check(std::integral_constant<int, 8>());
}

TEST_CASE("On the circle the normaliser is a Bessel function", "[bingham]") {
  // N = 2 pi e^((z1+z2)/2) I0((z1-z2)/2); libstdc++'s I0 is good to about 1e-14.
  for (const double z : {-1e-8, -0.1, -1.0, -7.0, -50.0, -300.0}) {
    CAPTURE(z);
    const double expected = std::log(2.0 * std::numbers::pi * std::cyl_bessel_i(0.0, -0.5 * z)) + 0.5 * z;
    CHECK(std::abs(bingham_log_normalizer(Vector2<double>(z, 0.0)) - expected) <= 1e-12);
  }
}

TEST_CASE("Far out the density is Gaussian about the mode", "[bingham]") {
  // log N = log(2 pi^((d-1)/2) prod (-z_i)^(-1/2)) + O(1/z), omega_i = -1/(2 z_i) (1 + O(1/z)).
  for (const double z : {-1e8, -1e11, -1e15}) {
    CAPTURE(z);
    const Vector4<double> concentrations(z, 0.5 * z, 0.25 * z, 0.0);
    const auto n = bingham_normalizer(concentrations);
    const double log_gauss =
        std::log(2.0) + 1.5 * std::log(std::numbers::pi) - 0.5 * std::log(-0.125 * z) - std::log(-z);
    CHECK(std::abs(n.log_normalizer - log_gauss) <= 1e-13 - 10.0 / z);
    for (int i = 0; i < 3; ++i) {
      CHECK(std::abs(-2.0 * concentrations[i] * n.second_moments[i] - 1.0) <= 1e-12 - 20.0 / z);
    }
  }
}

TEMPLATE_TEST_CASE("A shift of z shifts log N and leaves the moments", "[bingham][law]", float, double) {
  for_random_concentrations<TestType>([](const auto& z) {
    if (z[0] < TestType(-1e3)) return;  // the shift itself would round z
    const auto n = bingham_normalizer(z);
    for (const TestType c : {TestType(-64), TestType(64)}) {
      const auto shifted = bingham_normalizer((z.array() + c).matrix().eval());
      const double rounding = 4.0 * kEpsilon<TestType> * static_cast<double>(TestType(64) - z[0]);
      CHECK(static_cast<double>(std::abs(shifted.log_normalizer - (n.log_normalizer + c))) <= rounding);
      CHECK(max_difference(shifted.second_moments, n.second_moments) <= rounding);
    }
  });
}

TEMPLATE_TEST_CASE("The order of z does not matter", "[bingham][law]", float, double) {
  for_random_concentrations<TestType>([](const auto& z) {
    const auto n = bingham_normalizer(z);
    const auto reversed = bingham_normalizer(z.reverse().eval());
    const double tolerance = 1e-13 + 2.0 * kEpsilon<TestType>;
    CHECK(std::abs(static_cast<double>(reversed.log_normalizer - n.log_normalizer)) <=
          tolerance * (1.0 + std::abs(static_cast<double>(n.log_normalizer))));
    CHECK(max_relative_difference(reversed.second_moments.reverse(), n.second_moments) <= tolerance);
  });
}

TEMPLATE_TEST_CASE("Second and fourth moments fulfil their identities", "[bingham][law]", float, double) {
  for_random_concentrations<TestType>([](const auto& z) {
    constexpr int kDim = std::decay_t<decltype(z)>::RowsAtCompileTime;
    CAPTURE(z.transpose());
    const auto n = bingham_normalizer_hessian(z);
    const auto omega = n.second_moments.template cast<double>().eval();
    const auto fourth = n.fourth_moments.template cast<double>().eval();
    const double tolerance = 1e-12 + kDim * kEpsilon<TestType>;
    CHECK(std::abs(omega.sum() - 1.0) <= tolerance);
    CHECK(omega.minCoeff() > 0.0);
    CHECK(max_relative_difference(fourth.rowwise().sum(), omega) <= tolerance);
    for (int i = 0; i < kDim; ++i) {
      for (int j = i + 1; j < kDim; ++j) {
        const double left = (static_cast<double>(z[i]) - static_cast<double>(z[j])) * fourth(i, j);
        CHECK(std::abs(left - 0.5 * (omega[i] - omega[j])) <= tolerance * (omega[i] + omega[j]));
      }
    }
    CHECK(max_difference(n.hessian() + n.second_moments * n.second_moments.transpose(), n.fourth_moments) <=
          2.0 * kEpsilon<TestType>);
  });
}

TEST_CASE("The moments are the derivatives of log N", "[bingham][law]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Vector4<double> z = random_concentrations<double, 4>(rng, -1.0, 2.0);
    const auto n = bingham_normalizer_hessian(z);
    for (int i = 0; i < 4; ++i) {
      // Central differences with step h: truncation h^2/6 of third derivatives below one, rounding 1e-13/h.
      const double h = 1e-4;
      const auto plus = bingham_normalizer((z + h * Vector4<double>::Unit(i)).eval());
      const auto minus = bingham_normalizer((z - h * Vector4<double>::Unit(i)).eval());
      const double slope = (plus.log_normalizer - minus.log_normalizer) / (2.0 * h);
      CHECK(std::abs(slope - n.second_moments[i]) <= 3e-9);
      CHECK(max_difference((plus.second_moments - minus.second_moments) / (2.0 * h), n.hessian().col(i)) <=
            3e-9);
    }
  }
}

TEMPLATE_TEST_CASE("Concentrations that are not finite or too far apart are refused", "[bingham][error]",
                   float, double) {
  constexpr TestType kNan = std::numeric_limits<TestType>::quiet_NaN();
  constexpr TestType kInfinity = std::numeric_limits<TestType>::infinity();
  for (const TestType bad : {kNan, kInfinity, -kInfinity, TestType(-1.1e15), TestType(1.1e15)}) {
    const Vector3<TestType> z(bad, TestType(-1), TestType(0));
    CHECK_THROWS_AS(bingham_log_normalizer(z), std::invalid_argument);
    CHECK_THROWS_AS(bingham_normalizer(z), std::invalid_argument);
    CHECK_THROWS_AS(bingham_normalizer_hessian(z), std::invalid_argument);
  }
  const auto far_apart = [] {
    return bingham_log_normalizer(Vector2<TestType>(TestType(-1.5e17), TestType(0)));
  };
  CHECK(contains(error_message(far_apart), "e+17"));
  CHECK_NOTHROW(bingham_log_normalizer(Vector2<TestType>(TestType(-9e14), TestType(0))));
}
