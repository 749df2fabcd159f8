// SPDX-License-Identifier: MIT
#include <cmath>

#include <Eigen/LU>

#include <antipode/distributions/gaussian.hpp>
#include <antipode/distributions/gaussian_information.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Information = GaussianInformation<double, 3>;

[[nodiscard]] Information random_information(Rng& rng) {
  const Vector3<double> mean = random_matrix<double, 3, 1>(rng);
  return Information::from_covariance(mean, random_covariance<double, 3>(rng));
}

}  // namespace

TEST_CASE("Mean and covariance come back from the information", "[gaussian-information]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Vector3<double> mean = random_matrix<double, 3, 1>(rng);
    const Matrix3<double> covariance = random_covariance<double, 3>(rng);
    const Information x = Information::from_covariance(mean, covariance);
    CHECK(max_difference(x.mean(), mean) < 1e-12);
    CHECK(max_difference(x.covariance(), covariance) < 1e-12);
    const Gaussian<double, 3> density(mean, covariance);
    const Vector3<double> a = random_matrix<double, 3, 1>(rng), b = random_matrix<double, 3, 1>(rng);
    CHECK(x.log_density(a) - x.log_density(b) ==
          Approx(density.log_density(a) - density.log_density(b)).margin(1e-9));
  }
}

TEST_CASE("The sum of two densities is their product, and the difference takes one out",
          "[gaussian-information]") {
  Rng rng(1);
  const Information x = random_information(rng), y = random_information(rng);
  const Information both = x + y;
  const Vector3<double> a = random_matrix<double, 3, 1>(rng);
  CHECK(both.log_density(a) == Approx(x.log_density(a) + y.log_density(a)).epsilon(1e-12));
  const Information without = both - y;
  CHECK(max_difference(without.mean(), x.mean()) < 1e-12);
}

TEST_CASE("The evidence is the density of what was measured", "[gaussian-information]") {
  // Measured: m ~ N(x, R). With x ~ N(mean, P) it is N(mean, P + R), but for a factor that is the same for
  // all priors.
  Rng rng(2);
  const Matrix3<double> R = random_covariance<double, 3>(rng);
  const Vector3<double> m = random_matrix<double, 3, 1>(rng);
  const Information measured = Information::from_covariance(m, R);
  double first = 0.0;
  for (int k = 0; k < 10; ++k) {
    const Information prior = random_information(rng);
    const Gaussian<double, 3> marginal(prior.mean(), prior.covariance() + R);
    const double difference = prior.log_evidence(measured) - marginal.log_density(m);
    if (k == 0) first = difference;
    CHECK(difference == Approx(first).margin(1e-9));
  }
}

TEST_CASE("What leaves a direction open has no mean, and says so by not being finite",
          "[gaussian-information]") {
  const Information nothing;
  CHECK_FALSE(nothing.mean().allFinite());
  CHECK_FALSE(nothing.covariance().allFinite());
  CHECK(std::isnan(nothing.log_evidence(nothing)));
  CHECK_FALSE(Information::from_covariance(Vector3<double>::Zero(), -Matrix3<double>::Identity())
                  .information.allFinite());
}
