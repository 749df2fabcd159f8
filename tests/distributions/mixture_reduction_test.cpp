// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include <antipode/distributions/mixture_reduction.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// E[log x - log y] over draws of x, with its standard error.
struct Estimate {
  double value, error;
};
Estimate divergence(const PoseMixture& x, const PoseMixture& y, unsigned seed) {
  Rng rng(seed);
  constexpr int kDraws = 20000;
  double sum = 0.0, squares = 0.0;
  for (int k = 0; k < kDraws; ++k) {
    const auto pose = x.sample(rng);
    const double ratio = x.log_density(pose) - y.log_density(pose);
    sum += ratio / kDraws;
    squares += ratio * ratio / kDraws;
  }
  return {sum, std::sqrt((squares - sum * sum) / kDraws)};
}

constexpr auto kCriteria = {MergeCriterion::kRunnalls, MergeCriterion::kSymmetricKullbackLeibler};

}  // namespace

TEST_CASE("The table returns pairs in the order of an exhaustive search", "[reduction]") {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    // Things are numbers; merging adds them and costs their distance, at least half of it.
    std::vector<double> things(12);
    for (double& thing : things) thing = uniform<double>(rng, 0.0, 1.0);
    const auto cost = [&](std::size_t i, std::size_t j) { return std::abs(things[i] - things[j]); };
    const auto bound = [&](std::size_t i, std::size_t j) {
      const double infinity = std::numeric_limits<double>::infinity();
      return (i + j) % 7 == 0 ? infinity : uniform<double>(rng, 0.5, 1.0) * cost(i, j);
    };
    detail::MergeTable<double> pairs(things.size(), bound);
    while (const auto best = pairs.cheapest(cost)) {
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < things.size(); ++i) {
        for (std::size_t j = i + 1; j < things.size(); ++j) {
          if (pairs.alive(i) && pairs.alive(j) && (i + j) % 7 != 0) least = std::min(least, cost(i, j));
        }
      }
      REQUIRE(best->cost == least);
      things[best->i] += things[best->j];
      pairs.merge(best->i, best->j, bound);
    }
    CHECK(pairs.size() < things.size());
  }
}

TEST_CASE("Dropping changes no probability by more than the weight dropped", "[reduction]") {
  Rng rng(1);
  const auto pose = random_pose<double>(rng);
  std::vector<PoseMixture::Element> elements;
  for (const double weight : {0.5, 0.03, 0.4, 0.05, 0.02}) {
    elements.push_back({weight, random_density_at(rng, nearby_pose(rng, pose, 0.3, 0.5), 0.03, 0.1)});
  }
  const PoseMixture x(elements);
  const auto reduced = reduce(x, {.min_weight = 0.04});
  CHECK(reduced.mixture.size() == 3);
  CHECK(reduced.dropped == 2);
  CHECK(reduced.merged == 0);
  CHECK(reduced.dropped_weight == Approx(0.05));
  CHECK(reduced.probability_bound == Approx(0.05));
  CHECK(reduced.mixture[0].weight == Approx(0.5 / 0.95));
  // The sets {p > q} and {p < q} tell mixtures apart best: none better than the bound.
  constexpr int kDraws = 20000;
  int x_says = 0, reduced_says = 0;
  const auto likelier = [&](const DualQuaternion<double>& draw) {
    return x.log_density(draw) > reduced.mixture.log_density(draw) ? 1 : 0;
  };
  for (int k = 0; k < kDraws; ++k) {
    x_says += likelier(x.sample(rng));
    reduced_says += likelier(reduced.mixture.sample(rng));
  }
  CHECK(x_says - reduced_says <= (0.05 + 4.0 / std::sqrt(kDraws)) * kDraws);
  CHECK(x_says - reduced_says >= (0.05 - 4.0 / std::sqrt(kDraws)) * kDraws);
}

TEST_CASE("The divergence to the reduced mixture is within the bound it reports", "[reduction][random]") {
  for (const MergeCriterion criterion : kCriteria) {
    for (unsigned seed = 0; seed < 6; ++seed) {
      CAPTURE(seed);
      Rng rng(seed);
      const Spread spread{.angle = 0.1, .distance = 0.2, .sigma_u = 0.03, .sigma_t = 0.15};
      const auto x = random_mixture(rng, 12, random_pose<double>(rng), spread);
      const auto reduced = reduce(x, {.max_components = 4, .criterion = criterion});
      REQUIRE(reduced.mixture.size() == 4);
      CHECK(reduced.merged == 8);
      CHECK(reduced.dropped == 0);
      const auto forward = divergence(x, reduced.mixture, seed), back = divergence(reduced.mixture, x, seed);
      const bool symmetric = criterion == MergeCriterion::kSymmetricKullbackLeibler;
      const double value = symmetric ? forward.value + back.value : forward.value;
      CHECK(value <= reduced.divergence + 4.0 * (forward.error + back.error));
      CHECK(reduced.divergence > 0.0);
      CHECK(reduced.probability_bound >= std::sqrt(reduced.divergence / (symmetric ? 4.0 : 2.0)));
    }
  }
}

TEST_CASE("Single precision fuses and reduces to the same mixture", "[reduction][float]") {
  Rng rng(7);
  const auto pose = random_pose<double>(rng);
  using FloatComponent = ProjectedGaussian<float>;
  const auto rounded = [](const PoseMixture& x) {
    std::vector<Mixture<FloatComponent>::Element> elements;
    for (const auto& [weight, density] : x) {
      elements.push_back({static_cast<float>(weight),
                          FloatComponent(density.tangent_point().cast<float>(), density.mean().cast<float>(),
                                         density.covariance().cast<float>())});
    }
    return Mixture<FloatComponent>::normalized(std::move(elements));
  };
  const auto a = random_mixture(rng, 3, pose), b = random_mixture(rng, 3, pose);
  const auto in_double = reduce(fuse(a, b).mixture, {.max_components = 4});
  const auto in_float = reduce(fuse(rounded(a), rounded(b)).mixture, {.max_components = 4});
  REQUIRE(in_float.mixture.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    // Rounding times the condition of the covariances, 1e2 each and 1e2 for the units.
    CHECK(std::abs(static_cast<double>(in_float.mixture[i].weight) - in_double.mixture[i].weight) <= 1e-3);
    const auto x = in_float.mixture[i].density.pose().cast<double>();
    CHECK(x.boxminus(in_double.mixture[i].density.pose()).norm() <= 1e-3);
  }
}

TEST_CASE("Reduction keeps mean and covariance", "[reduction][law]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto pose = random_pose<double>(rng);
    const auto x = random_mixture(rng, 10, pose, {.angle = 1e-3, .distance = 0.2, .sigma_u = 3e-4});
    for (const std::size_t count : {5, 1}) {
      const auto reduced = reduce(x, {.max_components = count});
      REQUIRE(reduced.mixture.size() == count);
      const auto before = tangent_moments(x, pose.rotation());
      const auto after = tangent_moments(reduced.mixture, pose.rotation());
      for (int i = 0; i < 6; ++i) {
        const double sigma = std::sqrt(before.covariance(i, i));
        // Up to changes of the tangent space by 1e-3.
        CHECK(std::abs(after.mean[i] - before.mean[i]) <= 2e-3 * sigma);
        CHECK(std::abs(after.covariance(i, i) / before.covariance(i, i) - 1.0) <= 4e-3);
      }
    }
  }
}

TEST_CASE("A budget of divergence is used and not exceeded", "[reduction]") {
  Rng rng(2);
  const auto x = random_mixture(rng, 10, random_pose<double>(rng));
  const auto few = reduce(x, {.max_components = 3}), none = reduce(x);
  CHECK(none.mixture.size() == 10);
  CHECK(none.divergence == 0.0);
  const auto budget = reduce(x, {.max_divergence = few.divergence});
  CHECK(budget.mixture.size() <= 3);
  CHECK(budget.divergence <= few.divergence);
  const auto half = reduce(x, {.max_divergence = 0.5 * few.divergence});
  CHECK(half.mixture.size() > budget.mixture.size());
  CHECK(half.mixture.size() < 10);
}

TEST_CASE("Merging copies costs nothing, for either sign", "[reduction]") {
  Rng rng(3);
  const auto x = random_density_at(rng, random_pose<double>(rng), 0.1, 0.3);
  for (const MergeCriterion criterion : kCriteria) {
    const auto reduced = reduce(PoseMixture({{0.5, x}, {0.3, with_flipped_sign(x)}, {0.2, x}}),
                                {.max_components = 1, .criterion = criterion});
    CHECK(reduced.divergence <= 1e-12);
    CHECK(max_difference(reduced.mixture[0].density.covariance(), x.covariance()) <= 1e-14);
  }
}

TEST_CASE("Components too far apart to merge are dropped, smallest weight first", "[reduction]") {
  Rng rng(4);
  const auto pose = random_pose<double>(rng);
  const auto at = [&](double angle) {
    return random_density_at(rng, nearby_pose(rng, pose, angle, 0.0), 0.03, 0.1);
  };
  const PoseMixture x({{0.5, at(0.0)}, {0.2, at(1.5)}, {0.3, at(3.0)}});
  const auto reduced = reduce(x, {.max_components = 1});
  REQUIRE(reduced.mixture.size() == 1);
  CHECK(reduced.merged == 0);
  CHECK(reduced.dropped_weight == Approx(0.5));
  CHECK(reduced.mixture[0].density.pose().is_approx(x[0].density.pose(), 1e-12));
}

TEST_CASE("Components on a plane are merged, not dropped", "[reduction]") {
  Rng rng(5);
  const auto pose = random_pose<double>(rng);
  Vector6<double> variances;
  variances << 0, 0, 1e-2, 1e-2, 1e-2, 0;
  const PoseComponent planar(pose, variances.asDiagonal());
  for (const MergeCriterion criterion : kCriteria) {
    const auto copies = reduce(PoseMixture({{0.5, planar}, {0.5, planar}}),
                               {.max_components = 1, .max_divergence = 1e-6, .criterion = criterion});
    REQUIRE(copies.mixture.size() == 1);
    CHECK(copies.merged == 1);
    CHECK(copies.dropped_weight == 0.0);
    CHECK(copies.divergence <= 1e-9);
    CHECK(max_difference(copies.mixture[0].density.covariance(), planar.covariance()) <= 1e-15);
  }
  // Within the plane, those that are near each other merge first; the cost is that of the regular
  // coordinates.
  const auto at = [&](double x) {
    Vector6<double> mean;
    mean << 0, 0, 0, pose.translation() + Vector3<double>(x, 0, 0);
    return PoseComponent(pose.rotation(), mean, planar.covariance());
  };
  const auto reduced =
      reduce(PoseMixture({{0.25, at(0)}, {0.25, at(3)}, {0.5, at(0.1)}}), {.max_components = 2});
  REQUIRE(reduced.mixture.size() == 2);
  CHECK(reduced.mixture[0].weight == Approx(0.75));
  // a b d^2 = 2/9 of one variance: log(1 + 2/9) / 2 times the weight.
  CHECK(reduced.divergence == Approx(0.75 * 0.5 * std::log(1.0 + 2.0 / 9.0)).epsilon(1e-9));
}

TEST_CASE("A certain component merges with another only if there is no other way", "[reduction]") {
  Rng rng(5);
  const auto pose = random_pose<double>(rng);
  const PoseComponent certain(pose, Matrix6<double>::Zero());
  const auto x = random_density_at(rng, pose, 0.1, 0.3);
  const PoseMixture mixture({{0.5, certain}, {0.25, x}, {0.25, x}});
  CHECK(reduce(mixture, {.max_divergence = 10.0}).mixture.size() == 2);
  const auto one = reduce(mixture, {.max_components = 1});
  CHECK(one.merged == 2);
  CHECK(one.dropped_weight == 0.0);
  CHECK_THROWS_AS(symmetric_kl_divergence(certain, x), std::domain_error);
  // All certain: merged by their distances.
  const PoseComponent here(pose, Matrix6<double>::Zero());
  const PoseComponent there(nearby_pose(rng, pose, 0.1, 0.1), Matrix6<double>::Zero());
  const auto two = reduce(PoseMixture({{0.4, certain}, {0.3, there}, {0.3, here}}), {.max_components = 2});
  REQUIRE(two.mixture.size() == 2);
  CHECK(two.mixture[0].weight == Approx(0.7));
}

TEST_CASE("Many components reduce to as good a mixture as by an exhaustive search", "[reduction]") {
  // The reference chooses every pair by its exact cost.
  Rng rng(8);
  const auto pose = random_pose<double>(rng);
  for (const double sigma_u : {0.03, 0.1}) {
    const auto x = random_mixture(rng, 180, pose, {.angle = 0.1, .distance = 0.2, .sigma_u = sigma_u});
    const auto reduced = reduce(x, {.max_components = 135});
    double divergence = 0.0;
    std::vector<PoseMixture::Element> alive(x.begin(), x.end());
    while (alive.size() > 135) {
      double least = std::numeric_limits<double>::infinity();
      std::size_t best_i = 0, best_j = 0;
      for (std::size_t j = 0; j < alive.size(); ++j) {
        for (std::size_t i = 0; i < j; ++i) {
          const double bound = detail::merge_cost_bound<double>(
              alive[i].weight, detail::TranslationMarginal<double>(alive[i].density), alive[j].weight,
              detail::TranslationMarginal<double>(alive[j].density));
          if (bound >= least) continue;
          const double cost =
              detail::merge_cost(MergeCriterion::kRunnalls, alive[i].weight, alive[j].weight,
                                 detail::MergedPair<double>(alive[i].weight, alive[i].density,
                                                            alive[j].weight, alive[j].density));
          if (cost < least) std::tie(least, best_i, best_j) = std::tuple(cost, i, j);
        }
      }
      divergence += least;
      auto& [w, p] = alive[best_i];
      p = merge(w, p, alive[best_j].weight, alive[best_j].density);
      w += alive[best_j].weight;
      alive.erase(alive.begin() + static_cast<std::ptrdiff_t>(best_j));
    }
    CHECK(reduced.mixture.size() == 135);
    CHECK(reduced.divergence == Approx(divergence).epsilon(0.01));
  }
}

TEST_CASE("A thousand components merge into their moments, and those too far apart stay", "[reduction]") {
  Rng rng(9);
  const auto pose = random_pose<double>(rng);
  const auto near = random_mixture(rng, 600, pose, {.angle = 0.05, .distance = 0.2, .sigma_u = 0.03});
  const auto far =
      random_mixture(rng, 400, nearby_pose(rng, pose, 2.0, 0.0), {.angle = 0.05, .distance = 0.2});
  std::vector<PoseMixture::Element> elements;
  for (const auto& [weight, density] : near) elements.push_back({0.7 * weight, density});
  for (const auto& [weight, density] : far) elements.push_back({0.3 * weight, density});
  const auto reduced = reduce(PoseMixture::normalized(std::move(elements)), {.max_components = 2});
  REQUIRE(reduced.mixture.size() == 2);
  CHECK(reduced.dropped == 0);
  CHECK(reduced.mixture[0].weight == Approx(0.7));
  const auto expected = tangent_moments(near, pose.rotation());
  const auto merged = tangent_moments(PoseMixture(reduced.mixture[0].density), pose.rotation());
  const Vector6<double> sigma = expected.covariance.diagonal().cwiseSqrt();
  // Up to changes of the tangent space by 0.05.
  CHECK(((merged.mean - expected.mean).array() / sigma.array()).abs().maxCoeff() <= 0.05);
  CHECK((merged.covariance.diagonal().array() / expected.covariance.diagonal().array() - 1.0)
            .abs()
            .maxCoeff() <= 0.1);
}

TEST_CASE("A reduction to zero components is refused", "[reduction][error]") {
  Rng rng(6);
  const PoseMixture x(random_density_at(rng, random_pose<double>(rng), 0.1, 0.3));
  const auto message = [&](const MixtureReductionOptions<double>& options) {
    return error_message([&] { return reduce(x, options); });
  };
  CHECK(contains(message({.max_components = 0}), "leaves no component"));
  CHECK(contains(message({.min_weight = 1.0}), "leaves no component"));
  CHECK(contains(message({.min_weight = std::numeric_limits<double>::quiet_NaN()}), "leaves no component"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(contains(message({.max_angle = nan}), "max_angle is negative or NaN [rad]: nan"));
  CHECK(contains(message({.max_angle = -0.1}), "max_angle is negative or NaN [rad]: -0.1"));
  CHECK(contains(message({.max_divergence = nan}), "max_divergence is negative or NaN: nan"));
  // The heaviest stays, however light.
  CHECK(reduce(PoseMixture({{0.5, x[0].density}, {0.5, x[0].density}}), {.min_weight = 0.9}).mixture.size() ==
        2);
}
