// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include <antipode/sampling/gaussian_rules.hpp>
#include <antipode/sampling/point_sets.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// E[g_i^2 g_j^2] over weighted points.
template <class Scalar, int Dim, int Count>
Matrix<Scalar, Dim> fourth_moments(const WeightedSamples<Scalar, Dim, Count>& samples) {
  const Matrix<Scalar, Dim, Count> squares = samples.points.cwiseAbs2();
  return squares * samples.weights.asDiagonal() * squares.transpose();
}

/// What every GaussianRule promises.
template <class Scalar, GaussianRule Rule>
void check_laws(const Rule& rule) {
  constexpr double kTolerance = 40 * kEpsilon<Scalar>;
  const auto samples = rule.template standard<Scalar>();
  const auto& g = samples.points;
  CHECK(samples.weights.minCoeff() >= Scalar(0));
  CHECK(static_cast<double>(std::abs(samples.weights.sum() - Scalar(1))) <= kTolerance);
  CHECK(max_difference(g * samples.weights.asDiagonal() * g.transpose(),
                       Matrix<Scalar, Rule::kDim>::Identity()) <= kTolerance);
  for (int k = 0; k < Rule::kCount; ++k) {
    Scalar opposite(0);
    for (int l = 0; l < Rule::kCount; ++l) {
      if (max_difference(g.col(l), -g.col(k)) <= kTolerance) opposite += samples.weights[l];
    }
    CHECK(static_cast<double>(std::abs(opposite - samples.weights[k])) <= kTolerance);
  }
}

/// All fourth moments of N(0, I), those with odd powers included: E[g g^T (a.g)^2] = |a|^2 I + 2 a a^T.
template <class Scalar, GaussianRule Rule>
void check_degree_5(const Rule& rule) {
  constexpr int kDim = Rule::kDim;
  const auto samples = rule.template standard<Scalar>();
  Rng rng(1);
  for (int trial = 0; trial < 10; ++trial) {
    const Vector<Scalar, kDim> a = random_unit<Scalar, kDim>(rng);
    const Vector<Scalar, Rule::kCount> weights =
        samples.weights.cwiseProduct((samples.points.transpose() * a).cwiseAbs2());
    const Matrix<Scalar, kDim> expected = Matrix<Scalar, kDim>::Identity() + Scalar(2) * a * a.transpose();
    CHECK(max_difference(samples.points * weights.asDiagonal() * samples.points.transpose(), expected) <=
          60 * kEpsilon<Scalar>);
  }
}

}  // namespace

TEMPLATE_TEST_CASE("Every Gaussian rule is symmetric with unit covariance", "[rules][law]", float, double) {
  for (const double kappa : {0.0, 0.5, 3.0}) {
    CAPTURE(kappa);
    check_laws<TestType>(UnscentedRule<1>{kappa});
    check_laws<TestType>(UnscentedRule<3>{kappa});
    check_laws<TestType>(UnscentedRule<6>{kappa});
  }
  check_laws<TestType>(UnscentedRule<2>{});
  check_laws<TestType>(CubatureRule<3>{});
  check_laws<TestType>(CubatureRule<6>{});
  check_laws<TestType>(Degree5Rule<2>{});
  check_laws<TestType>(Degree5Rule<3>{});
  check_laws<TestType>(Degree5Rule<6>{});
  check_laws<TestType>(MysovskikhRule<2>{});
  check_laws<TestType>(MysovskikhRule<3>{});
  check_laws<TestType>(MysovskikhRule<6>{});
  Rng rng(2);
  check_laws<TestType>(PointSetRule<3, 6>::random(rng));
  check_laws<TestType>(PointSetRule<3, 50>::random(rng));
  check_laws<TestType>(PointSetRule<5, 24>::random(rng));
  check_laws<TestType>(PointSetRule<3, 12>::fibonacci());
  check_laws<TestType>(PointSetRule<3, 200>::fibonacci());
}

TEMPLATE_TEST_CASE("Degree-5 rules have the fourth moments of the Gaussian", "[rules]", float, double) {
  check_degree_5<TestType>(Degree5Rule<2>{});
  check_degree_5<TestType>(Degree5Rule<3>{});
  check_degree_5<TestType>(Degree5Rule<4>{});
  check_degree_5<TestType>(Degree5Rule<6>{});
  check_degree_5<TestType>(MysovskikhRule<2>{});
  check_degree_5<TestType>(MysovskikhRule<3>{});
  check_degree_5<TestType>(MysovskikhRule<4>{});
  check_degree_5<TestType>(MysovskikhRule<6>{});
}

TEST_CASE("Rules have the number of points they are known for", "[rules]") {
  STATIC_REQUIRE(UnscentedRule<3>::kCount == 7);
  STATIC_REQUIRE(CubatureRule<3>::kCount == 6);
  STATIC_REQUIRE(Degree5Rule<3>::kCount == 15);
  STATIC_REQUIRE(MysovskikhRule<6>::kCount == 57);
  STATIC_REQUIRE(!GaussianRule<Gaussian<double, 3>>);
}

TEST_CASE("The unscented rule has kurtosis Dim + kappa", "[rules]") {
  for (const double kappa : {0.0, 0.5, 3.0}) {
    CAPTURE(kappa);
    const auto fourth = fourth_moments(UnscentedRule<3>{kappa}.standard<double>());
    CHECK(max_difference(fourth, Matrix3<double>((3.0 + kappa) * Matrix3<double>::Identity())) <= 1e-14);
  }
  CHECK(fourth_moments(UnscentedRule<2>{}.standard<double>())(0, 0) == Approx(3.0).epsilon(1e-14));
}

TEST_CASE("Many Fibonacci points approach the fourth moments of the Gaussian", "[rules]") {
  const auto error = [](const auto& samples) {
    const Matrix3<double> gauss = Matrix3<double>::Ones() + 2.0 * Matrix3<double>::Identity();
    return max_difference(fourth_moments(samples), gauss);
  };
  const double coarse = error(PointSetRule<3, 50>::fibonacci().standard<double>());
  const double fine = error(PointSetRule<3, 800>::fibonacci().standard<double>());
  CHECK(coarse < 0.7);
  CHECK(fine < 0.1);
}

TEST_CASE("Random point sets repeat with their seed", "[rules][random]") {
  Rng first(3), second(3), third(4);
  const auto points = PointSetRule<4, 20>::random(first).standard<double>().points;
  CHECK(points == PointSetRule<4, 20>::random(second).standard<double>().points);
  CHECK(points != PointSetRule<4, 20>::random(third).standard<double>().points);
}

TEMPLATE_TEST_CASE("Samples of a Gaussian have its mean and covariance, singular or not", "[rules][law]",
                   float, double) {
  const auto check = [](const auto& rule, const Gaussian<TestType, 3>& g) {
    const auto samples = sample(rule, g);
    const Vector3<TestType> mean = samples.points * samples.weights;
    CHECK(max_difference(mean, g.mean()) <= 30 * kEpsilon<TestType>);
    const auto centred = (samples.points.colwise() - g.mean()).eval();
    CHECK(max_difference(centred * samples.weights.asDiagonal() * centred.transpose(), g.covariance()) <=
          60 * kEpsilon<TestType>);
  };
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Vector3<TestType> mean = random_matrix<TestType, 3, 1>(rng);
    for (const int rank : {0, 1, 2, 3}) {
      const Matrix3<TestType> A = random_matrix<TestType, 3>(rng);
      const Gaussian<TestType, 3> g(mean, A.leftCols(rank) * A.leftCols(rank).transpose());
      check(UnscentedRule<3>{1.5}, g);
      check(CubatureRule<3>{}, g);
      check(Degree5Rule<3>{}, g);
      check(PointSetRule<3, 30>::fibonacci(), g);
    }
  }
}

TEST_CASE("The unscented points of a regular covariance use its lower Cholesky factor", "[rules]") {
  const Gaussian<double, 2> g(Vector2<double>(1.0, 2.0), Matrix2<double>{{4.0, 2.0}, {2.0, 10.0}});
  const auto samples = sample(UnscentedRule<2>{.kappa = 2.0}, g);
  Matrix<double, 2, 5> expected;
  expected << 1, 5, 1, -3, 1,  //
      2, 4, 8, 0, -4;
  CHECK(max_difference(samples.points, expected) <= 1e-14);
  CHECK(samples.weights[0] == 0.5);
}

TEST_CASE("A spread that would need negative weights is refused with its value", "[rules][error]") {
  for (const double kappa :
       {-0.5, -3.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const auto message = error_message([&] { return UnscentedRule<3>{kappa}.standard<double>(); });
    CHECK(contains(message, "kappa of the unscented rule is not in [0, inf)"));
  }
  CHECK(contains(error_message([] { return UnscentedRule<3>{-0.5}.standard<double>(); }), "-0.5"));
}

TEST_CASE("Points drawn in a plane make no rule", "[rules][error]") {
  struct Constant {
    using result_type = std::uint32_t;
    static constexpr result_type min() { return 0; }
    static constexpr result_type max() { return 0xffffffff; }
    result_type operator()() { return 0x6fffffff; }
  } constant;
  CHECK(contains(error_message([&] { return PointSetRule<3, 8>::random(constant); }), "span no volume"));
}
