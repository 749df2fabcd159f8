// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include <antipode/sampling/bingham_rules.hpp>
#include <antipode/sampling/point_sets.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/reference.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// What every Bingham rule promises: unit points, a probability, the scatter of the density.
template <class Rule, class Scalar, int Dim>
void check_laws(const Rule& rule, const Bingham<Scalar, Dim>& bingham) {
  const auto samples = sample(rule, bingham);
  CHECK(samples.weights.minCoeff() >= Scalar(0));
  CHECK(static_cast<double>(std::abs(samples.weights.sum() - Scalar(1))) <= 20 * kEpsilon<Scalar>);
  CHECK(max_difference(samples.points.colwise().norm(), Matrix<Scalar, 1, samples.kCount>::Ones()) <=
        8 * kEpsilon<Scalar>);
  const Matrix<Scalar, Dim> scatter =
      samples.points * samples.weights.asDiagonal() * samples.points.transpose();
  CHECK(max_difference(scatter, bingham.scatter()) <= 40 * kEpsilon<Scalar>);
}

/// A rule read from a file: K points g with weights c, and the mode with weight lambda.
template <int Dim, int Count>
struct TabulatedRule {
  static constexpr int kDim = Dim;
  static constexpr int kCount = Count + 1;

  Matrix<double, Count, Dim> g;
  Vector<double, Count> c;
  double lambda;

  template <class Scalar>
  [[nodiscard]] WeightedSamples<Scalar, Dim, kCount> standard() const {
    WeightedSamples<double, Dim, kCount> samples;
    samples.points << Vector<double, Dim>::Zero(), g.transpose() / std::sqrt(1.0 - lambda);
    samples.weights << lambda, (1.0 - lambda) * c;
    return {samples.points.template cast<Scalar>(), samples.weights.template cast<Scalar>()};
  }
};

/// Each reference point is among the samples, up to sign, with its weight.
template <int Dim, int Count>
void check_same_samples(const WeightedSamples<double, Dim, Count>& samples, const nlohmann::json& reference) {
  const auto points = to_matrix<Count, Dim>(reference.at("points"));
  const auto weights = to_vector<Count>(reference.at("weights"));
  for (int k = 0; k < Count; ++k) {
    double nearest = std::numeric_limits<double>::infinity();
    for (int l = 0; l < Count; ++l) {
      const Vector<double, Dim> a = samples.points.col(l), b = points.row(k).transpose();
      const double distance = std::min(max_difference(a, b), max_difference(a, -b));
      nearest = std::min(nearest, std::max(distance, std::abs(samples.weights[l] - weights[k])));
    }
    CHECK(nearest <= 1e-12);
  }
}

template <int Dim>
void check_reference_case(const nlohmann::json& reference) {
  CAPTURE(reference.at("scheme"), reference.at("z"), reference.at("lam"));
  const auto bingham = Bingham<double, Dim>::from_parameters(to_matrix<Dim>(reference.at("M")),
                                                             to_vector<Dim>(reference.at("z")));
  CHECK(max_relative_difference(bingham.second_moments(), to_vector<Dim>(reference.at("omega"))) <= 1e-12);
  const double lambda = reference.at("lam").get<double>();
  if (reference.at("scheme") == "base") {
    check_same_samples<Dim, 2 * Dim - 1>(sample(BinghamBaseRule{lambda}, bingham), reference);
  } else if constexpr (Dim == 4) {
    const TabulatedRule<3, 14> cubature{to_matrix<14, 3>(reference.at("g")), to_vector<14>(reference.at("c")),
                                        lambda};
    check_same_samples<4, 15>(sample(GnomonicRule<TabulatedRule<3, 14>>{cubature}, bingham), reference);
  }
}

/// Concentrations from uniform to certain, of equal and of mixed sizes.
template <class Scalar>
Bingham<Scalar, 4> assorted_bingham(unsigned seed) {
  Rng rng(seed);
  if (seed == 0) return Bingham<Scalar, 4>::uniform();
  if (seed == 1) {
    return Bingham<Scalar, 4>::from_parameters(
        random_orthogonal<Scalar, 4>(rng),
        Vector4<Scalar>(Scalar(-1e8), Scalar(-1e8), Scalar(-1e8), Scalar(0)));
  }
  return random_bingham<Scalar, 4>(rng, -2.0, seed % 2 ? 2.0 : 8.0);
}

template <class Scalar, int Count>
Matrix4<Scalar> fourth_moments(const Bingham<Scalar, 4>& bingham,
                               const WeightedSamples<Scalar, 4, Count>& samples) {
  const Matrix<Scalar, 4, Count> squares = (bingham.axes().transpose() * samples.points).cwiseAbs2();
  return squares * samples.weights.asDiagonal() * squares.transpose();
}

}  // namespace

TEST_CASE("Base and gnomonic points agree with 35-digit values", "[rules][oracle]") {
  const auto cases = read_reference("bingham_sigma_points.json").at("cases");
  REQUIRE(cases.size() == 63);
  for (const auto& reference : cases) {
    switch (reference.at("dim").get<int>()) {
      case 2:
        check_reference_case<2>(reference);
        break;
      case 3:
        check_reference_case<3>(reference);
        break;
      default:
        check_reference_case<4>(reference);
    }
  }
}

TEMPLATE_TEST_CASE("Every Bingham rule reproduces the scatter exactly", "[rules][law]", float, double) {
  const auto fibonacci = PointSetRule<3, 40>::fibonacci();
  Rng rng(1);
  const auto random = PointSetRule<3, 26>::random(rng);
  for (unsigned seed = 0; seed < 30; ++seed) {
    CAPTURE(seed);
    const auto b = assorted_bingham<TestType>(seed);
    check_laws(BinghamBaseRule{}, b);
    check_laws(BinghamBaseRule{.lambda = 0.0}, b);
    check_laws(BinghamBaseRule{.lambda = 0.95}, b);
    check_laws(BinghamGnomonicRule{}, b);
    check_laws(GnomonicRule<CubatureRule<3>>{}, b);
    check_laws(GnomonicRule<MysovskikhRule<3>>{}, b);
    check_laws(GnomonicRule<PointSetRule<3, 40>>{fibonacci}, b);
    check_laws(GnomonicRule<PointSetRule<3, 26>>{random}, b);
    check_laws(EqualWeightRule<PointSetRule<3, 40>>{fibonacci}, b);
  }
}

TEST_CASE("Bingham rules work in other dimensions", "[rules][law]") {
  Rng rng(2);
  check_laws(BinghamBaseRule{}, random_bingham<double, 2>(rng, -1.0, 3.0));
  check_laws(BinghamBaseRule{}, random_bingham<double, 7>(rng, -1.0, 3.0));
  check_laws(GnomonicRule<Degree5Rule<2>>{}, random_bingham<double, 3>(rng, -1.0, 3.0));
  check_laws(GnomonicRule<Degree5Rule<5>>{}, random_bingham<double, 6>(rng, -1.0, 3.0));
}

TEMPLATE_TEST_CASE("A fit to the samples gives the density back", "[rules][law]", float, double) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<TestType, 4>(rng, -1.0, 1.5);
    const auto samples = sample(BinghamGnomonicRule{}, b);
    const auto c =
        Bingham<TestType, 4>::fit(samples.points * samples.weights.asDiagonal() * samples.points.transpose());
    const double omega = static_cast<double>(b.second_moments()[0]);
    CHECK(max_difference(c.concentrations(), b.concentrations()) <=
          100 * kEpsilon<TestType> / (omega * omega));
  }
}

TEST_CASE("Degree-5 orientations have the fourth moments of a concentrated density", "[rules]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<double, 4>(rng, 3.0, 6.0);
    const Matrix4<double> exact = b.fourth_moments();
    const auto error = [&](const auto& rule) {
      return max_relative_difference(fourth_moments(b, sample(rule, b)), exact);
    };
    // The tangent space is Gaussian up to the relative order omega_3, times the moments of degree 6.
    CHECK(error(BinghamGnomonicRule{}) <= 50.0 * b.second_moments()[2]);
    CHECK(error(GnomonicRule<MysovskikhRule<3>>{}) <= 50.0 * b.second_moments()[2]);
    CHECK(error(BinghamBaseRule{}) >= 0.9);
  }
}

TEST_CASE("Degree-5 orientations are within a tenth of the uniform density's fourth moments", "[rules]") {
  const auto b = Bingham<double, 4>::uniform();
  const auto samples = sample(BinghamGnomonicRule{}, b);
  CHECK(max_relative_difference(fourth_moments(b, samples), b.fourth_moments()) <= 0.1);
}

TEST_CASE("A dozen points or more can have equal weights", "[rules]") {
  const EqualWeightRule<PointSetRule<3, 12>> dozen{PointSetRule<3, 12>::fibonacci()};
  const EqualWeightRule<PointSetRule<3, 40>> more{PointSetRule<3, 40>::fibonacci()};
  for (unsigned seed = 0; seed < 30; ++seed) {
    CAPTURE(seed);
    const auto b = assorted_bingham<double>(seed);
    const auto samples = sample(more, b);
    CHECK(samples.weights.maxCoeff() == samples.weights.minCoeff());
    check_laws(dozen, b);
  }
}

TEST_CASE("Where equal weights cannot be had the samples are the gnomonic ones", "[rules]") {
  const auto b = Bingham<double, 4>::from_parameters(Matrix4<double>::Identity(), {-1e4, -1e4, -1e-3, 0.0});
  const EqualWeightRule<CubatureRule<3>> rule{};
  const auto samples = sample(rule, b), expected = sample(GnomonicRule<CubatureRule<3>>{}, b);
  CHECK(samples.weights == expected.weights);
  CHECK(samples.points == expected.points);
  check_laws(rule, b);
}

TEST_CASE("A weight of the mode outside its range is refused with its value", "[rules][error]") {
  const auto b = Bingham<double, 4>::uniform();
  for (const double lambda : {-0.1, 0.96, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK_THROWS_AS(sample(BinghamBaseRule{lambda}, b), std::invalid_argument);
  }
  CHECK(contains(error_message([&] { return sample(BinghamBaseRule{1.5}, b); }), "not in [0, 0.95]: 1.5"));
}
