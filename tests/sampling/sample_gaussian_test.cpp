// SPDX-License-Identifier: MIT
#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/cubature/point_sets.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/sampling/sample_gaussian.hpp>

#include "sampling/sample_list.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

using namespace antipode;
using namespace antipode::test;

TEMPLATE_TEST_CASE("Samples of a Gaussian have its mean and covariance, singular or not", "[rules][law]",
                   float, double) {
  const auto check = [](const SampleList& samples, const Gaussian<TestType, 3>& g) {
    const Eigen::VectorXd mean = g.mean().template cast<double>();
    CHECK(max_difference(samples.mean(), mean) <= 30 * kEpsilon<TestType>);
    CHECK(max_difference(samples.second_moments(mean), g.covariance()) <= 60 * kEpsilon<TestType>);
  };
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Vector3<TestType> mean = random_matrix<TestType, 3, 1>(rng);
    for (const int rank : {0, 1, 2, 3}) {
      Matrix3<TestType> A = random_matrix<TestType, 3>(rng);
      for (int i = rank; i < 3; ++i) A.col(i).setZero();
      const Gaussian<TestType, 3> g(mean,
                                    detail::scaled_square<TestType, 3, 3>(A, Vector3<TestType>::Ones()));
      check(SampleList(sample(UnscentedRule<3>{1.5}, g)), g);
      check(SampleList(sample(CubatureRule<3>{}, g)), g);
      check(SampleList(sample(Degree5Rule<3>{}, g)), g);
      check(SampleList(sample(PointSetRule<3, 12>::fibonacci(), g)), g);
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
