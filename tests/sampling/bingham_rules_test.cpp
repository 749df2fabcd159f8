// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <antipode/cubature/point_sets.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/sampling/bingham_rules.hpp>

#include "distributions/random_densities.hpp"
#include "sampling/sample_list.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/reference.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// What every Bingham rule promises: unit points, a probability, the scatter of the density.
void check_laws(const SampleList& samples, const Eigen::MatrixXd& scatter, double epsilon, double tolerance) {
  CAPTURE(samples.points.rows(), samples.points.cols(), epsilon);
  CHECK(samples.weights.minCoeff() >= 0.0);
  // The second moments of the density, which add up to the weights, are known to 1e-13.
  CHECK(std::abs(samples.weights.sum() - 1.0) <= 1e-13 + 20 * epsilon);
  for (Eigen::Index k = 0; k < samples.points.cols(); ++k) {
    CHECK(std::abs(samples.points.col(k).norm() - 1.0) <= 8 * epsilon);
  }
  CHECK(max_difference(samples.second_moments(), scatter) <= tolerance);
}

template <class Rule, class Scalar, int Dim>
void check_laws(const Rule& rule, const Bingham<Scalar, Dim>& bingham) {
  check_laws(SampleList(sample(rule, bingham)), bingham.scatter().template cast<double>(), kEpsilon<Scalar>,
             40 * kEpsilon<Scalar>);
}

/// The iteration stops at 256 roundings.
template <class Cubature, class Scalar>
void check_laws(const EqualWeightRule<Cubature>& rule, const Bingham<Scalar, 4>& bingham) {
  check_laws(SampleList(sample(rule, bingham)), bingham.scatter().template cast<double>(), kEpsilon<Scalar>,
             300 * kEpsilon<Scalar>);
}

/// A rule read from a file: 14 points g with weights c, and the mode with weight lambda.
struct TabulatedRule {
  static constexpr int kDim = 3;
  static constexpr int kCount = 15;

  Matrix<double, 14, 3> g;
  Vector<double, 14> c;
  double lambda;

  template <class Scalar>
  [[nodiscard]] WeightedSamples<Scalar, kDim, kCount> standard() const {
    WeightedSamples<Scalar, kDim, kCount> samples;
    samples.points.col(14).setZero();
    samples.weights[14] = static_cast<Scalar>(lambda);
    for (int k = 0; k < 14; ++k) {
      samples.weights[k] = static_cast<Scalar>((1.0 - lambda) * c[k]);
      for (int i = 0; i < kDim; ++i) {
        samples.points(i, k) = static_cast<Scalar>(g(k, i) / std::sqrt(1.0 - lambda));
      }
    }
    return samples;
  }
};

/// Each reference point is among the samples, up to sign, with its weight.
void check_same_samples(const SampleList& samples, const nlohmann::json& reference) {
  const auto points = reference.at("points").get<std::vector<std::vector<double>>>();
  const auto weights = reference.at("weights").get<std::vector<double>>();
  REQUIRE(points.size() == weights.size());
  REQUIRE(samples.points.cols() == static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Eigen::VectorXd point = Eigen::Map<const Eigen::VectorXd>(points[k].data(), samples.points.rows());
    double nearest = std::numeric_limits<double>::infinity();
    for (Eigen::Index l = 0; l < samples.points.cols(); ++l) {
      const Eigen::VectorXd x = samples.points.col(l);
      const double distance = std::min(max_difference(x, point), max_difference(x, -point));
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
    check_same_samples(SampleList(sample(BinghamBaseRule{lambda}, bingham)), reference);
  } else if constexpr (Dim == 4) {
    const GnomonicRule<TabulatedRule> rule{
        {to_matrix<14, 3>(reference.at("g")), to_vector<14>(reference.at("c")), lambda}};
    check_same_samples(SampleList(sample(rule, bingham)), reference);
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

/// Of the samples, in the eigenbasis of the density: relative to it, the largest error of E[x_i^2 x_j^2].
double fourth_moment_error(SampleList samples, const Bingham<double, 4>& bingham) {
  for (Eigen::Index k = 0; k < samples.points.cols(); ++k) {
    const Vector4<double> x = samples.points.col(k);
    samples.points.col(k) = bingham.axes().transpose() * x;
  }
  const Matrix4<double> fourth = samples.squares().second_moments();
  return max_relative_difference(fourth, bingham.fourth_moments());
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
  const auto random = PointSetRule<3, 40>::random(rng);
  for (unsigned seed = 0; seed < 30; ++seed) {
    CAPTURE(seed);
    const auto b = assorted_bingham<TestType>(seed);
    check_laws(BinghamBaseRule{}, b);
    check_laws(BinghamBaseRule{.lambda = 0.0}, b);
    check_laws(BinghamBaseRule{.lambda = 0.95}, b);
    check_laws(BinghamGnomonicRule{}, b);
    check_laws(GnomonicRule<PointSetRule<3, 40>>{fibonacci}, b);
    check_laws(GnomonicRule<PointSetRule<3, 40>>{random}, b);
    check_laws(EqualWeightRule<PointSetRule<3, 40>>{fibonacci}, b);
  }
}

TEST_CASE("Bingham rules work in other dimensions", "[rules][law]") {
  Rng rng(2);
  check_laws(BinghamBaseRule{}, random_bingham<double, 2>(rng, -1.0, 3.0));
  check_laws(GnomonicRule<Degree5Rule<2>>{}, random_bingham<double, 3>(rng, -1.0, 3.0));
  const auto b = random_bingham<double, 6>(rng, -1.0, 3.0);
  check_laws(BinghamBaseRule{}, b);
  check_laws(GnomonicRule<Degree5Rule<5>>{}, b);
}

TEMPLATE_TEST_CASE("A fit to the samples gives the density back", "[rules][law]", float, double) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<TestType, 4>(rng, -1.0, 1.5);
    const auto samples = sample(BinghamGnomonicRule{}, b);
    const auto c = Bingham<TestType, 4>::fit(
        detail::scaled_square<TestType, 4, samples.kCount>(samples.points, samples.weights));
    // Moments rounded, and solved for to 1e-13: z ~ -1/(2 omega), with up to four times that slope.
    const double omega = static_cast<double>(b.second_moments()[0]);
    CHECK(max_difference(c.concentrations(), b.concentrations()) <=
          2.0 * (2e-13 + 40 * kEpsilon<TestType>) / (omega * omega));
  }
}

TEST_CASE("Degree-5 orientations have the fourth moments of a concentrated density", "[rules]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<double, 4>(rng, 3.0, 6.0);
    const auto error = [&](const auto& rule) { return fourth_moment_error(SampleList(sample(rule, b)), b); };
    // The tangent space is Gaussian up to the relative order omega_3, times the moments of degree 6.
    check_laws(GnomonicRule<MysovskikhRule<3>>{}, b);
    CHECK(error(BinghamGnomonicRule{}) <= 50.0 * b.second_moments()[2]);
    CHECK(error(GnomonicRule<MysovskikhRule<3>>{}) <= 50.0 * b.second_moments()[2]);
    CHECK(error(BinghamBaseRule{}) >= 0.9);
  }
}

TEST_CASE("Degree-5 orientations are within a tenth of the uniform density's fourth moments", "[rules]") {
  const auto b = Bingham<double, 4>::uniform();
  CHECK(fourth_moment_error(SampleList(sample(BinghamGnomonicRule{}, b)), b) <= 0.1);
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

TEST_CASE("Where equal weights are impossible the samples are the gnomonic ones", "[rules]") {
  const auto b = Bingham<double, 4>::from_parameters(Matrix4<double>::Identity(), {-1e4, -1e4, -1e-3, 0.0});
  const EqualWeightRule<CubatureRule<3>> rule{};
  const auto samples = sample(rule, b), expected = sample(GnomonicRule<CubatureRule<3>>{}, b);
  CHECK(max_difference(samples.weights, expected.weights) == 0.0);
  CHECK(max_difference(samples.points, expected.points) == 0.0);
  check_laws(rule, b);
}

TEST_CASE("A weight of the mode outside its range is refused with its value", "[rules][error]") {
  const auto b = Bingham<double, 4>::uniform();
  for (const double lambda : {-0.1, 0.96, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK_THROWS_AS(sample(BinghamBaseRule{lambda}, b), std::invalid_argument);
  }
  CHECK(contains(error_message([&] { return sample(BinghamBaseRule{1.5}, b); }), "not in [0, 0.95]: 1.5"));
}
