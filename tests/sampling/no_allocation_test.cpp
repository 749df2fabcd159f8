// SPDX-License-Identifier: MIT
#include "support/no_allocation.hpp"

#include <cmath>

#include <antipode/cubature/point_sets.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/sampling/bingham_rules.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

TEST_CASE("Construction, evaluation and draws of densities do not allocate", "[allocation]") {
  Rng rng(1);
  const auto x = random_bingham_gaussian<double>(rng, 0.0, 3.0);
  const auto y = random_pose<double>(rng);
  const double sum = without_allocation([&] {
    const auto& b = x.orientation();
    const auto product = b.product(compose(b, compose(y.rotation(), b)));
    const auto moved = compose(compose(y, x), y);
    const auto narrow = BinghamGaussian<double>::from_pose_covariance(y, x.covariance());
    const Gaussian<double, 3> g(x.mean_translation(), x.conditional_covariance());
    return product.kl_divergence(b) + product.entropy() + product.sample(rng).sum() + moved.log_density(y) +
           narrow.sample(rng).coeffs().sum() + moved.translation_covariance().sum() +
           g.log_density(g.sample(rng));
  });
  CHECK(std::isfinite(sum));
}

TEST_CASE("Sampling and moment matching do not allocate", "[allocation]") {
  Rng rng(2);
  const auto x = random_bingham_gaussian<double>(rng, 0.0, 3.0);
  const auto match = [&](const auto& rule) {
    const auto matched = without_allocation([&] { return moment_match(sample(rule, x)); });
    CHECK(std::isfinite(matched.log_density(x.pose())));
  };
  using Fibonacci = PointSetRule<3, 20>;
  match(PaperPoseRule{});
  match(RichPoseRule{});
  match(JointPoseRule{});
  match(CartesianPoseRule<EqualWeightRule<Fibonacci>, CubatureRule<3>>{{Fibonacci::fibonacci()}, {}});
}
