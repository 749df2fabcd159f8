// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/cubature/point_sets.hpp>
#include <antipode/detail/products.hpp>

#include "sampling/sample_list.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The points of a rule as computed in a scalar type.
struct RulePoints : SampleList {
  double epsilon;

  [[nodiscard]] MatrixXd identity() const { return MatrixXd::Identity(points.rows(), points.rows()); }
};

template <class Scalar, GaussianRule Rule>
[[nodiscard]] RulePoints points_of(const Rule& rule) {
  return {SampleList(rule.template standard<Scalar>()), kEpsilon<Scalar>};
}

/// What every GaussianRule promises.
void check_laws(const RulePoints& rule) {
  CAPTURE(rule.points.rows(), rule.points.cols(), rule.epsilon);
  // One rounding for every point.
  const double tolerance = std::max(40.0, static_cast<double>(rule.points.cols())) * rule.epsilon;
  const auto& [points, weights] = static_cast<const SampleList&>(rule);
  CHECK(weights.minCoeff() >= 0.0);
  CHECK(std::abs(weights.sum() - 1.0) <= tolerance);
  CHECK(max_difference(rule.second_moments(), rule.identity()) <= tolerance);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    double here = 0.0, opposite = 0.0;  // points may coincide
    for (Eigen::Index l = 0; l < points.cols(); ++l) {
      if ((points.col(l) - points.col(k)).norm() <= tolerance) here += weights[l];
      if ((points.col(l) + points.col(k)).norm() <= tolerance) opposite += weights[l];
    }
    CHECK(std::abs(opposite - here) <= tolerance);
  }
}

/// All fourth moments of N(0, I), those with odd powers included: E[g g^T (a.g)^2] = |a|^2 I + 2 a a^T.
void check_degree_5(RulePoints rule) {
  const VectorXd weights = rule.weights;
  Rng rng(1);
  for (int trial = 0; trial < 10; ++trial) {
    VectorXd a = random_matrix<double, 18, 1>(rng).head(rule.points.rows());
    a /= a.norm();
    MatrixXd expected = rule.identity();
    for (Eigen::Index j = 0; j < a.size(); ++j) expected.col(j) += 2.0 * a[j] * a;
    for (Eigen::Index k = 0; k < weights.size(); ++k) {
      const double product = rule.points.col(k).dot(a);
      rule.weights[k] = weights[k] * product * product;
    }
    CHECK(max_difference(rule.second_moments(), expected) <= 60 * rule.epsilon);
  }
}

}  // namespace

TEMPLATE_TEST_CASE("Every Gaussian rule is symmetric with unit covariance", "[rules][law]", float, double) {
  for (const double kappa : {0.0, 0.5, 3.0}) {
    CAPTURE(kappa);
    check_laws(points_of<TestType>(UnscentedRule<1>{kappa}));
    check_laws(points_of<TestType>(UnscentedRule<3>{kappa}));
    check_laws(points_of<TestType>(UnscentedRule<6>{kappa}));
  }
  check_laws(points_of<TestType>(UnscentedRule<2>{}));
  check_laws(points_of<TestType>(CubatureRule<3>{}));
  check_laws(points_of<TestType>(CubatureRule<6>{}));
  check_laws(points_of<TestType>(Degree5Rule<2>{}));
  check_laws(points_of<TestType>(Degree5Rule<3>{}));
  check_laws(points_of<TestType>(Degree5Rule<6>{}));
  check_laws(points_of<TestType>(Degree5Rule<7>{}));
  check_laws(points_of<TestType>(Degree5Rule<12>{}));
  check_laws(points_of<TestType>(Degree5Rule<18>{}));
  check_laws(points_of<TestType>(MysovskikhRule<2>{}));
  check_laws(points_of<TestType>(MysovskikhRule<3>{}));
  check_laws(points_of<TestType>(MysovskikhRule<6>{}));
  Rng rng(2);
  check_laws(points_of<TestType>(PointSetRule<3, 6>::random(rng)));
  check_laws(points_of<TestType>(PointSetRule<5, 24>::random(rng)));
  check_laws(points_of<TestType>(PointSetRule<3, 12>::fibonacci()));
  check_laws(points_of<TestType>(PointSetRule<3, 50>::fibonacci()));
}

TEMPLATE_TEST_CASE("Degree-5 rules have the fourth moments of the Gaussian", "[rules]", float, double) {
  check_degree_5(points_of<TestType>(Degree5Rule<2>{}));
  check_degree_5(points_of<TestType>(Degree5Rule<3>{}));
  check_degree_5(points_of<TestType>(Degree5Rule<4>{}));
  check_degree_5(points_of<TestType>(Degree5Rule<6>{}));
  check_degree_5(points_of<TestType>(Degree5Rule<7>{}));
  check_degree_5(points_of<TestType>(Degree5Rule<8>{}));
  check_degree_5(points_of<TestType>(Degree5Rule<9>{}));
  check_degree_5(points_of<TestType>(Degree5Rule<10>{}));
  check_degree_5(points_of<TestType>(Degree5Rule<12>{}));
  check_degree_5(points_of<TestType>(Degree5Rule<13>{}));
  check_degree_5(points_of<TestType>(Degree5Rule<18>{}));
  check_degree_5(points_of<TestType>(MysovskikhRule<2>{}));
  check_degree_5(points_of<TestType>(MysovskikhRule<3>{}));
  check_degree_5(points_of<TestType>(MysovskikhRule<4>{}));
  check_degree_5(points_of<TestType>(MysovskikhRule<6>{}));
}

TEST_CASE("Rules have the number of points they are known for", "[rules]") {
  STATIC_REQUIRE(UnscentedRule<3>::kCount == 7);
  STATIC_REQUIRE(CubatureRule<3>::kCount == 6);
  STATIC_REQUIRE(Degree5Rule<3>::kCount == 15);
  STATIC_REQUIRE(Degree5Rule<7>::kCount == 78);
  STATIC_REQUIRE(Degree5Rule<9>::kCount == 146);
  STATIC_REQUIRE(Degree5Rule<12>::kCount == 280);
  STATIC_REQUIRE(Degree5Rule<18>::kCount == 548);
  STATIC_REQUIRE(MysovskikhRule<6>::kCount == 57);
  STATIC_REQUIRE(!GaussianRule<Vector3<double>>);
}

TEST_CASE("The unscented rule has kurtosis Dim + kappa", "[rules]") {
  for (const double kappa : {0.0, 0.5, 3.0}) {
    CAPTURE(kappa);
    const auto rule = points_of<double>(UnscentedRule<3>{kappa});
    CHECK(max_difference(rule.squares().second_moments(), (3.0 + kappa) * rule.identity()) <= 1e-14);
  }
  const auto planar = points_of<double>(UnscentedRule<2>{});
  CHECK(max_difference(planar.squares().second_moments(), 3.0 * planar.identity()) <= 1e-14);
}

TEST_CASE("Many Fibonacci points approach the fourth moments of the Gaussian", "[rules]") {
  const auto error = [](const RulePoints& rule) {
    const MatrixXd gauss = 2.0 * rule.identity() + MatrixXd::Ones(3, 3);
    return max_difference(rule.squares().second_moments(), gauss);
  };
  const double coarse = error(points_of<double>(PointSetRule<3, 50>::fibonacci()));
  const double fine = error(points_of<double>(PointSetRule<3, 800>::fibonacci()));
  CHECK(coarse < 0.7);
  CHECK(fine < 0.1);
}

TEST_CASE("Random point sets repeat with their seed", "[rules][random]") {
  Rng first(3), second(3), third(4);
  const auto draw = [](Rng& rng) { return points_of<double>(PointSetRule<5, 24>::random(rng)).points; };
  const MatrixXd points = draw(first);
  CHECK(max_difference(points, draw(second)) == 0.0);
  CHECK(max_difference(points, draw(third)) > 0.1);
}

TEST_CASE("A spread that would need negative weights is refused with its value", "[rules][error]") {
  for (const double kappa :
       {-0.5, -3.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const auto message = error_message([&] { return UnscentedRule<3>{kappa}.standard<double>(); });
    CHECK(contains(message, "kappa of the unscented rule is not in [0, inf)"));
  }
  CHECK(contains(error_message([] { return UnscentedRule<3>{-0.5}.standard<double>(); }), "-0.5"));
}

TEST_CASE("Points in a plane are refused as a rule", "[rules][error]") {
  struct Constant {
    using result_type = std::uint32_t;
    static constexpr result_type min() { return 0; }
    static constexpr result_type max() { return 0xffffffff; }
    result_type operator()() { return 0x6fffffff; }
  } constant;
  CHECK(contains(error_message([&] { return PointSetRule<3, 6>::random(constant); }), "span no volume"));
}
