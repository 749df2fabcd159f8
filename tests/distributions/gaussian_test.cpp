// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <antipode/distributions/gaussian.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

TEMPLATE_TEST_CASE("The root of a covariance squares to it, singular or not", "[gaussian][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Matrix<TestType, 4> A = random_matrix<TestType, 4>(rng);
    for (const int rank : {0, 1, 2, 3, 4}) {
      const Matrix<TestType, 4> covariance = A.leftCols(rank) * A.leftCols(rank).transpose();
      const Gaussian<TestType, 4> g(A.col(0), covariance);
      CHECK(max_difference(g.sqrt_factor() * g.sqrt_factor().transpose(), covariance) <=
            40 * kEpsilon<TestType>);
      CHECK(g.mean() == A.col(0));
    }
  }
}

TEST_CASE("The root of a regular covariance is its lower Cholesky factor", "[gaussian]") {
  const Matrix2<double> covariance{{4.0, 2.0}, {2.0, 10.0}};
  const Gaussian<double, 2> g(Vector2<double>::Zero(), covariance);
  const Matrix2<double> expected{{2.0, 0.0}, {1.0, 3.0}};
  CHECK(max_difference(g.sqrt_factor(), expected) <= 1e-15);
}

TEMPLATE_TEST_CASE("The log density is that of independent normals after whitening", "[gaussian]", float,
                   double) {
  // N(mu, A A^T) at mu + A u has the density of N(0, I) at u over |det A|.
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Matrix3<TestType> A = random_matrix<TestType, 3>(rng) + Matrix3<TestType>::Identity() * TestType(3);
    const Vector3<TestType> mean = random_matrix<TestType, 3, 1>(rng), u = random_matrix<TestType, 3, 1>(rng);
    const Gaussian<TestType, 3> g(mean, A * A.transpose());
    const TestType standard =
        TestType(-0.5) * u.squaredNorm() - TestType(1.5 * std::log(2.0 * std::numbers::pi));
    const TestType expected = standard - std::log(std::abs(A.determinant()));
    CHECK(static_cast<double>(std::abs(g.log_density(mean + A * u) - expected)) <= 200 * kEpsilon<TestType>);
  }
}

TEST_CASE("A singular Gaussian has samples but no density", "[gaussian][error]") {
  const Matrix3<double> covariance = Vector3<double>(1.0, 0.0, 4.0).asDiagonal();
  const Gaussian<double, 3> g(Vector3<double>(1.0, 2.0, 3.0), covariance);
  Rng rng(1);
  CHECK(g.sample(rng)[1] == 2.0);
  CHECK_THROWS_AS(g.log_density(g.mean()), std::domain_error);
}

TEMPLATE_TEST_CASE("Draws have the mean and the covariance", "[gaussian][random]", float, double) {
  Rng rng(7);
  const Matrix3<TestType> covariance = random_covariance<TestType, 3>(rng);
  const Vector3<TestType> mean = random_matrix<TestType, 3, 1>(rng);
  const Gaussian<TestType, 3> g(mean, covariance);
  constexpr int kDraws = 40000;
  Vector3<double> sum = Vector3<double>::Zero();
  Matrix3<double> squares = Matrix3<double>::Zero();
  for (int k = 0; k < kDraws; ++k) {
    const Vector3<double> x = (g.sample(rng) - mean).template cast<double>();
    sum += x;
    squares += x * x.transpose();
  }
  // Eigenvalues are at most one: standard errors at most 1/sqrt(n) and sqrt(2/n); five of them.
  CHECK((sum / kDraws).cwiseAbs().maxCoeff() <= 5.0 / std::sqrt(kDraws));
  CHECK(max_difference(squares / kDraws, covariance.template cast<double>()) <=
        5.0 * std::sqrt(2.0 / kDraws));
}

TEMPLATE_TEST_CASE("Invalid covariances are refused with their value", "[gaussian][error]", float, double) {
  using Density = Gaussian<TestType, 2>;
  constexpr TestType kNan = std::numeric_limits<TestType>::quiet_NaN();
  const Vector2<TestType> zero = Vector2<TestType>::Zero();
  const auto with = [&](TestType a, TestType b, TestType c, TestType d) {
    return error_message([&] {
      Matrix2<TestType> m;
      m << a, b, c, d;
      return Density(zero, m);
    });
  };
  CHECK(contains(with(1, TestType(0.5), TestType(0.25), 1), "not symmetric: [1, 0.5; 0.25, 1]"));
  CHECK(contains(with(1, 2, 2, 1), "negative eigenvalue: [1, 2; 2, 1]"));
  CHECK(contains(with(TestType(-1), 0, 0, 0), "negative eigenvalue"));
  CHECK(contains(with(kNan, 0, 0, 1), "not finite"));
  CHECK(contains(with(std::numeric_limits<TestType>::infinity(), 0, 0, 1), "not finite"));
  CHECK(contains(error_message([&] {
                   return Density(Vector2<TestType>(TestType(0), kNan), Matrix2<TestType>::Identity());
                 }),
                 "mean is not finite"));
}

TEST_CASE("Asymmetry and negative eigenvalues of rounding size are accepted", "[gaussian]") {
  Matrix2<double> covariance{{1.0, 1.0}, {1.0, 1.0 - 1e-12}};
  CHECK_NOTHROW(Gaussian<double, 2>(Vector2<double>::Zero(), covariance));
  covariance(0, 1) += 1e-11;
  const Gaussian<double, 2> g(Vector2<double>::Zero(), covariance);
  CHECK(g.covariance()(0, 1) == g.covariance()(1, 0));
}
