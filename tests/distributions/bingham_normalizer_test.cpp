// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <antipode/distributions/bingham_normalizer.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"
#include "support/csv.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The normaliser and its derivatives in double, whatever they were computed in, and in any dimension: what
/// checks them compiles once.
struct Moments {
  double log_normalizer;
  VectorXd second;
  MatrixXd fourth, hessian;
};

template <class Scalar, int Dim>
[[nodiscard]] Moments moments(const VectorXd& concentrations) {
  const Vector<Scalar, Dim> z = concentrations.cast<Scalar>();
  const auto n = bingham_normalizer_hessian(z);
  const auto first = bingham_normalizer(z);
  CHECK(static_cast<double>(std::abs(first.log_normalizer - bingham_log_normalizer(z))) <= 1e-14);
  CHECK(static_cast<double>(std::abs(first.log_normalizer - n.log_normalizer)) <= 1e-14);
  CHECK(max_relative_difference(first.second_moments, n.second_moments) <= 1e-14);
  return {static_cast<double>(n.log_normalizer), n.second_moments.template cast<double>(),
          n.fourth_moments.template cast<double>(), n.hessian().template cast<double>()};
}

struct Instance {
  int dim;
  double epsilon;
  Moments (*moments)(const VectorXd& z);
};
constexpr Instance kInstances[] = {
    {3, kEpsilon<float>, moments<float, 3>},   {4, kEpsilon<float>, moments<float, 4>},
    {2, kEpsilon<double>, moments<double, 2>}, {3, kEpsilon<double>, moments<double, 3>},
    {4, kEpsilon<double>, moments<double, 4>}, {5, kEpsilon<double>, moments<double, 5>},
    {6, kEpsilon<double>, moments<double, 6>}, {7, kEpsilon<double>, moments<double, 7>},
    {8, kEpsilon<double>, moments<double, 8>},
};

/// Calls f(instance, z) for random z over sixteen decades, rounded to float.
template <class Function>
void for_random_concentrations(const Function& f) {
  for (const Instance& instance : kInstances) {
    for (unsigned seed = 0; seed < 40; ++seed) {
      CAPTURE(instance.dim, instance.epsilon, seed);
      Rng rng(seed);
      VectorXd z(instance.dim);
      for (double& entry : z) {
        entry = -std::pow(10.0, uniform<double>(rng, -4.0, seed % 2 ? 2.0 : 12.0));
        entry = static_cast<double>(static_cast<float>(entry));
      }
      z[0] = 0.0;
      f(instance, z);
    }
  }
}

/// Largest entry of |a - b| relative to b.
double relative_difference(const VectorXd& a, const VectorXd& b) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < b.size(); ++i) largest = std::max(largest, std::abs(a[i] / b[i] - 1.0));
  return largest;
}

template <int Dim>
void check_against_reference(const std::string& file, std::size_t rows) {
  const auto table = read_csv(file);
  REQUIRE(table.size() == rows);
  for (const auto& row : table) {
    REQUIRE(row.size() == 2 * Dim + 1);
    const VectorXd z = Eigen::Map<const VectorXd>(row.data(), Dim);
    const VectorXd gradient = Eigen::Map<const VectorXd>(row.data() + Dim + 1, Dim);
    CAPTURE(row);
    const auto n = moments<double, Dim>(z);
    CHECK(std::abs(n.log_normalizer - row[Dim]) <= 1e-12);
    CHECK(relative_difference(n.second, gradient) <= 1e-12);
  }
}

}  // namespace

TEST_CASE("The normaliser and its gradient agree with 35-digit values", "[bingham][oracle]") {
  check_against_reference<2>("bingham_norm_s1.csv", 15);
  check_against_reference<3>("bingham_norm_s2.csv", 41);
  check_against_reference<4>("bingham_norm_s3.csv", 95);
  check_against_reference<6>("bingham_norm_s5.csv", 54);
}

TEST_CASE("Fourth moments agree with 35-digit values", "[bingham][oracle]") {
  const auto table = read_csv("bingham_hess_s3.csv");
  REQUIRE(table.size() == 24);
  for (const auto& row : table) {
    REQUIRE(row.size() == 14);
    CAPTURE(row);
    const auto n = moments<double, 4>(Eigen::Map<const VectorXd>(row.data(), 4));
    std::size_t column = 4;
    for (int i = 0; i < 4; ++i) {
      for (int j = i; j < 4; ++j) {
        CHECK(std::abs(n.fourth(i, j) / row[column++] - 1.0) <= 1e-12);
        CHECK(n.fourth(j, i) == n.fourth(i, j));
      }
    }
  }
}

TEST_CASE("The uniform density has the area of the sphere as its normaliser", "[bingham]") {
  for (const Instance& instance : kInstances) {
    const auto n = instance.moments(VectorXd::Zero(instance.dim));
    const double half = 0.5 * instance.dim;
    const double area = std::log(2.0) + half * std::log(std::numbers::pi) - std::lgamma(half);
    CAPTURE(instance.dim, instance.epsilon);
    CHECK(std::abs(n.log_normalizer - area) <= 1e-13 + 4.0 * instance.epsilon);
    for (const double omega : n.second) {
      CHECK(std::abs(omega * instance.dim - 1.0) <= 1e-12 + instance.epsilon);
    }
  }
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

TEST_CASE("A shift of z shifts log N and leaves the moments", "[bingham][law]") {
  for_random_concentrations([](const Instance& instance, const VectorXd& z) {
    if (z.minCoeff() < -1e3) return;  // the shift itself would round z
    const auto n = instance.moments(z);
    for (const double c : {-64.0, 64.0}) {
      const auto shifted = instance.moments(z.array() + c);
      const double rounding = 4.0 * instance.epsilon * (64.0 - z.minCoeff());
      CHECK(std::abs(shifted.log_normalizer - (n.log_normalizer + c)) <= rounding);
      CHECK((shifted.second - n.second).cwiseAbs().maxCoeff() <= rounding);
    }
  });
}

TEST_CASE("The order of z does not matter", "[bingham][law]") {
  for_random_concentrations([](const Instance& instance, const VectorXd& z) {
    const auto n = instance.moments(z);
    const auto reversed = instance.moments(z.reverse());
    const double tolerance = 1e-13 + 2.0 * instance.epsilon;
    CHECK(std::abs(reversed.log_normalizer - n.log_normalizer) <=
          tolerance * (1.0 + std::abs(n.log_normalizer)));
    CHECK(relative_difference(reversed.second.reverse(), n.second) <= tolerance);
  });
}

TEST_CASE("Second and fourth moments fulfil their identities", "[bingham][law]") {
  for_random_concentrations([](const Instance& instance, const VectorXd& z) {
    const auto n = instance.moments(z);
    const VectorXd& omega = n.second;
    const double tolerance = 1e-12 + instance.dim * instance.epsilon;
    CHECK(std::abs(omega.sum() - 1.0) <= tolerance);
    CHECK(omega.minCoeff() > 0.0);
    for (int i = 0; i < instance.dim; ++i) {
      double row_sum = 0.0;
      for (int j = 0; j < instance.dim; ++j) {
        row_sum += n.fourth(i, j);
        CHECK(std::abs(n.hessian(i, j) + omega[i] * omega[j] - n.fourth(i, j)) <= 2.0 * instance.epsilon);
        if (i == j) continue;
        const double left = (z[i] - z[j]) * n.fourth(i, j);
        CHECK(std::abs(left - 0.5 * (omega[i] - omega[j])) <= tolerance * (omega[i] + omega[j]));
      }
      CHECK(std::abs(row_sum / omega[i] - 1.0) <= tolerance);
    }
  });
}

TEST_CASE("The moments are the derivatives of log N", "[bingham][law]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Vector4<double> z = random_concentrations<double, 4>(rng, -1.0, 2.0);
    const auto n = bingham_normalizer_hessian(z);
    const Matrix4<double> hessian = n.hessian();
    for (int i = 0; i < 4; ++i) {
      // Central differences with step h: truncation h^2/6 of third derivatives below one, rounding 1e-13/h.
      const double h = 1e-4;
      Vector4<double> above = z, below = z;
      above[i] += h;
      below[i] -= h;
      const auto plus = bingham_normalizer(above), minus = bingham_normalizer(below);
      const double slope = (plus.log_normalizer - minus.log_normalizer) / (2.0 * h);
      CHECK(std::abs(slope - n.second_moments[i]) <= 3e-9);
      for (int j = 0; j < 4; ++j) {
        const double second = (plus.second_moments[j] - minus.second_moments[j]) / (2.0 * h);
        CHECK(std::abs(second - hessian(i, j)) <= 3e-9);
      }
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
