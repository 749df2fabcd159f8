// SPDX-License-Identifier: MIT
#include "support/no_allocation.hpp"

#include <antipode/distributions/mixture_reduction.hpp>
#include <antipode/distributions/projected_gaussian_conversions.hpp>
#include <antipode/sampling/sample_projected_gaussian.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

TEST_CASE("Operations on single components do not allocate", "[allocation]") {
  for (const double sigma_u : {0.05, 0.3, 2.0}) {
    Rng rng(1);
    const auto pose = random_pose<double>(rng);
    const auto a = random_density_at(rng, pose, sigma_u, 0.5);
    const auto b = random_density_at(rng, nearby_pose(rng, pose, 0.2, 0.3), sigma_u, 0.5);
    CHECK(without_allocation([&] { return fuse(a, b); }).density.is_centered());
    CHECK(without_allocation([&] { return compose(a, b); }).is_centered());
    CHECK(without_allocation([&] { return compose(a, b, Transport::kUnscented); }).is_centered());
    CHECK(without_allocation([&] { return inverse(a); }).is_centered());
    CHECK(without_allocation([&] { return merge(0.5, a, 0.5, b); }).is_centered());
    CHECK(without_allocation([&] { return match_push_forward(a); }).positive_definite());
    CHECK(std::isfinite(without_allocation([&] { return a.log_density(b.pose()); })));
    CHECK(without_allocation([&] { return a.sample(rng); }).coeffs().allFinite());
    CHECK(without_allocation([&] { return sample(CubatureRule<6>{}, a); }).weights.allFinite());
    const PoseMixture x({{0.5, a}, {0.5, b}});
    CHECK(std::isfinite(without_allocation([&] { return x.log_density(pose); })));
    CHECK(without_allocation([&] { return x.sample(rng); }).coeffs().allFinite());
  }
}

TEST_CASE("Fusing mixtures allocates by the mixture, not by the pair", "[allocation]") {
  // Eigen never does; the vectors of components do once, for all pairs.
  Rng rng(2);
  const auto pose = random_pose<double>(rng);
  const auto a = random_mixture(rng, 10, pose), b = random_mixture(rng, 7, pose);
  const auto fused = without_allocation([&] { return fuse(a, b).mixture; });
  CHECK(fused.elements().capacity() == 70);
  CHECK(without_allocation([&] { return reduce(fused, {.max_components = 10}); }).mixture.size() == 10);
}
