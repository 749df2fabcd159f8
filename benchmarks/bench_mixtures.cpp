// SPDX-License-Identifier: MIT
// Projected Gaussians and their mixtures beside what the paper does instead: a normaliser by Monte Carlo, and
// a reduction that works out every pair before each merger. Inputs vary: 64 random densities in turn.
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/mixture_fit.hpp>
#include <antipode/distributions/mixture_reduction.hpp>
#include <antipode/distributions/projected_gaussian_conversions.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"

namespace antipode::test {
namespace {

using Catch::Benchmark::Chronometer;

constexpr std::size_t kInputs = 64;
constexpr std::size_t at(int i) { return static_cast<std::size_t>(i) % kInputs; }

/// Pairs of densities of nearby poses, whose rotations have standard deviations up to 2 sigma_u about an
/// axis.
struct Pairs {
  std::vector<PoseComponent> a, b;

  explicit Pairs(double sigma_u) {
    Rng rng(1);
    for (std::size_t k = 0; k < kInputs; ++k) {
      const auto pose = random_pose<double>(rng);
      a.push_back(random_density_at(rng, pose, sigma_u, 0.5));
      b.push_back(random_density_at(rng, nearby_pose(rng, pose, 0.2, 0.3), sigma_u, 0.5));
    }
  }
};

/// Gaussians on the tangent space of a rotation.
struct Rotations {
  std::vector<Vector3<double>> means;
  std::vector<Matrix3<double>> covariances;

  explicit Rotations(double sigma_u) {
    Rng rng(2);
    for (std::size_t k = 0; k < kInputs; ++k) {
      means.push_back(random_matrix<double, 3, 1>(rng, 0.3 * sigma_u));
      covariances.push_back(sigma_u * sigma_u * random_covariance<double, 3>(rng));
    }
  }
};

/// C by 1000 draws: right to 1e-2 or so.
double monte_carlo_mass(const Vector3<double>& mean, const Matrix3<double>& Sigma, Rng& rng) {
  const Matrix3<double> L = *detail::cholesky_factor(Sigma);
  double sum = 0.0;
  constexpr int kDraws = 1000;
  for (int k = 0; k < kDraws; ++k) {
    const Vector3<double> u = mean + L * detail::standard_normal<double, 3>(rng);
    const double stretch = 1.0 + u.squaredNorm();
    sum += 1.0 / (stretch * stretch) / kDraws;
  }
  return sum;
}

/// Merges the cheapest of all pairs, all of them worked out, until `count` are left.
std::vector<PoseMixture::Element> merge_exhaustively(const PoseMixture& x, std::size_t count) {
  std::vector<PoseMixture::Element> elements = x.elements();
  while (elements.size() > count) {
    double least = std::numeric_limits<double>::infinity();
    std::size_t best_i = 0, best_j = 1;
    for (std::size_t i = 0; i < elements.size(); ++i) {
      for (std::size_t j = i + 1; j < elements.size(); ++j) {
        const auto& [w_1, p_1] = elements[i];
        const auto& [w_2, p_2] = elements[j];
        const detail::MergedPair<double> pair(w_1, p_1, w_2, p_2);
        const double cost = detail::merge_cost(MergeCriterion::kRunnalls, w_1, w_2, pair);
        if (cost < least) {
          least = cost;
          best_i = i;
          best_j = j;
        }
      }
    }
    elements[best_i] = {elements[best_i].weight + elements[best_j].weight,
                        merge(elements[best_i].weight, elements[best_i].density, elements[best_j].weight,
                              elements[best_j].density)};
    elements.erase(elements.begin() + static_cast<std::ptrdiff_t>(best_j));
  }
  return elements;
}

TEST_CASE("Normaliser", "[benchmark][mixtures]") {
  const Vector3<double> zero = Vector3<double>::Zero();
  for (const double sigma_u : {0.05, 0.3, 1.0}) {
    const Rotations in(sigma_u);
    const std::string width = ", sigma_u up to " + std::to_string(sigma_u).substr(0, 4);
    BENCHMARK_ADVANCED("C centred" + width)(Chronometer meter) {
      meter.measure([&](int i) { return detail::hemisphere_mass<double>(zero, in.covariances[at(i)]); });
    };
    BENCHMARK_ADVANCED("C off centre" + width)(Chronometer meter) {
      meter.measure(
          [&](int i) { return detail::hemisphere_mass<double>(in.means[at(i)], in.covariances[at(i)]); });
    };
  }
  const Rotations in(0.3);
  Rng rng(3);
  BENCHMARK_ADVANCED("C by Monte Carlo, 1000 draws")(Chronometer meter) {
    meter.measure([&](int i) { return monte_carlo_mass(in.means[at(i)], in.covariances[at(i)], rng); });
  };
}

TEST_CASE("Components", "[benchmark][mixtures]") {
  const Pairs in(0.1);
  BENCHMARK_ADVANCED("log density")(Chronometer meter) {
    meter.measure([&](int i) { return in.a[at(i)].log_density(in.b[at(i)].pose()); });
  };
  BENCHMARK_ADVANCED("draw")(Chronometer meter) {
    Rng rng(4);
    meter.measure([&](int i) { return in.a[at(i)].sample(rng).coeffs(); });
  };
  BENCHMARK_ADVANCED("fuse")(Chronometer meter) {
    meter.measure([&](int i) { return fuse(in.a[at(i)], in.b[at(i)]).log_mass; });
  };
  const Pairs wide(0.4);
  BENCHMARK_ADVANCED("fuse, wide")(Chronometer meter) {
    meter.measure([&](int i) { return fuse(wide.a[at(i)], wide.b[at(i)]).log_mass; });
  };
  BENCHMARK_ADVANCED("compose")(Chronometer meter) {
    meter.measure([&](int i) { return compose(in.a[at(i)], in.b[at(i)]).log_normalizer(); });
  };
  BENCHMARK_ADVANCED("compose by sigma points")(Chronometer meter) {
    meter.measure(
        [&](int i) { return compose(in.a[at(i)], in.b[at(i)], Transport::kUnscented).log_normalizer(); });
  };
  BENCHMARK_ADVANCED("to BinghamGaussian")(Chronometer meter) {
    meter.measure([&](int i) { return to_bingham_gaussian(in.a[at(i)]).mean_translation(); });
  };
}

TEST_CASE("Mixtures", "[benchmark][mixtures]") {
  Rng rng(5);
  const auto pose = random_pose<double>(rng);
  const auto a = random_mixture(rng, 10, pose), b = random_mixture(rng, 7, pose);
  const auto fused = fuse(a, b).mixture;
  BENCHMARK("fuse 10 x 7") { return fuse(a, b).log_mass; };
  BENCHMARK("reduce 70 to 10") { return reduce(fused, {.max_components = 10}).divergence; };
  BENCHMARK("reduce 70 to 10 exhaustively") { return merge_exhaustively(fused, 10).size(); };
  BENCHMARK("fuse 10 x 7 and reduce to 10") {
    return reduce(fuse(a, b).mixture, {.max_components = 10}).divergence;
  };
  BENCHMARK("compose 10 x 7") { return compose(a, b).size(); };
  const auto x = a.sample(rng);
  BENCHMARK("log density of 10 components") { return a.log_density(x); };
}

TEST_CASE("Fit", "[benchmark][mixtures]") {
  Rng rng(6);
  using Component = PushForwardGaussian<double>;
  const auto x = random_mixture<Component>(rng, 5, random_pose<double>(rng), {.angle = 2.0, .distance = 1.0});
  for (const int samples : {500, 5000}) {
    Matrix<double, 8, Eigen::Dynamic> poses(8, samples);
    for (int k = 0; k < samples; ++k) poses.col(k) = x.sample(rng).coeffs();
    const Vector<double, Eigen::Dynamic> weights = Vector<double, Eigen::Dynamic>::Ones(samples);
    BENCHMARK("fit 5 components to " + std::to_string(samples) + " samples") {
      Rng engine(7);
      return fit_mixture(poses, weights, 5, engine).log_likelihood;
    };
  }
}

}  // namespace
}  // namespace antipode::test
