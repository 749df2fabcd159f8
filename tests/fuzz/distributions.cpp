// SPDX-License-Identifier: MIT
// Bingham densities from any matrix, and mixtures of any components.
#include <cmath>
#include <random>
#include <vector>

#include <antipode/distributions/bingham.hpp>
#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/mixture_reduction.hpp>
#include <antipode/distributions/projected_gaussian.hpp>

#include "fuzz/fuzz_target.hpp"
#include "fuzz/hostile_input.hpp"

namespace antipode::fuzz {
namespace {

using Orientation = Bingham<double, 4>;
using Component = ProjectedGaussian<double>;

void require_density(const Orientation& b) {
  require(b.axes().allFinite() && b.concentrations().allFinite(), "parameters are not finite");
  require(b.concentrations()[3] == 0.0 && b.concentrations()[0] <= b.concentrations()[1] &&
              b.concentrations()[1] <= b.concentrations()[2] && b.concentrations()[2] <= 0.0,
          "concentrations do not ascend to zero");
  require(b.second_moments().allFinite() && b.second_moments().minCoeff() >= 0.0, "moments below zero");
  require(std::abs(b.second_moments().sum() - 1.0) < 1e-9, "moments do not sum to one");
  require(std::isfinite(b.log_normalizer()), "the normaliser is not finite");
  require(std::isfinite(b.log_density(b.mode())), "the density of the mode is not finite");
  require(std::isfinite(b.entropy()), "the entropy is not finite");
}

[[nodiscard]] Matrix4<double> any_matrix(HostileInput& input) {
  Matrix4<double> C = input.numbers<4, 4>();
  if (input.choice(4) > 0) C = Matrix4<double>(C.selfadjointView<Eigen::Lower>());
  return C;
}

void bingham(Bytes bytes) {
  HostileInput input(bytes);
  allow_refusal([&] {
    const Orientation b = Orientation::from_matrix(any_matrix(input));
    require_density(b);
    std::mt19937 rng(1);
    for (int i = 0; i < 4; ++i) {
      const auto x = b.sample(rng);
      require(std::abs(x.norm() - 1.0) < 1e-6, "a sample is not of unit length");
    }
    require_density(Orientation::fit(b.scatter()));
    require_density(compose(b, b));
    require(std::isfinite(b.kl_divergence(Orientation::uniform())), "the divergence is not finite");
    require_density(b.product(Orientation::from_matrix(any_matrix(input))));
  });
}

void bingham_fit(Bytes bytes) {
  HostileInput input(bytes);
  allow_refusal([&] { require_density(Orientation::fit(any_matrix(input))); });
  allow_refusal([&] {
    Matrix4<double> root = input.ordinary_numbers<4, 4>();
    for (int i = 0; i < 4; ++i) root.row(i) *= std::sqrt(input.scale());
    const Matrix4<double> scatter = root * root.transpose();
    const Orientation b = Orientation::fit(scatter / scatter.trace());
    require_density(b);
  });
  allow_refusal([&] {
    const Matrix3<double> Sigma = input.covariance<3>();
    require_density(Orientation::from_mode_covariance(input.numbers<4>(), Sigma));
  });
}

[[nodiscard]] Component component(HostileInput& input) {
  Vector4<double> q = input.ordinary_numbers<4>();
  if (q.norm() < 1e-6) q = Vector4<double>::UnitX();
  const Vector6<double> mean = input.choice(4) == 0 ? input.numbers<6>() : input.ordinary_numbers<6>();
  return {q.normalized(), mean, input.covariance<6>()};
}

void mixture_reduction(Bytes bytes) {
  HostileInput input(bytes);
  allow_refusal([&] {
    std::vector<Mixture<Component>::Element> elements;
    const unsigned count = 2 + input.choice(8);
    for (unsigned i = 0; i < count; ++i) elements.push_back({std::abs(input.number()), component(input)});
    const auto mixture = Mixture<Component>::normalized(elements);
    const MixtureReductionOptions<double> options{
        .max_components = 1 + input.choice(8),
        .min_weight = input.choice(4) == 0 ? std::abs(input.ordinary()) / 8.0 : 0.0,
        .max_divergence = input.choice(2) == 0 ? 0.0 : input.scale(),
        .max_angle = input.choice(2) == 0 ? 0.3 : 4.0,
        .criterion =
            input.choice(2) == 0 ? MergeCriterion::kRunnalls : MergeCriterion::kSymmetricKullbackLeibler};
    const auto result = reduce(mixture, options);
    require(result.mixture.size() <= options.max_components, "more components than allowed");
    double sum = 0.0;
    for (const auto& [weight, density] : result.mixture) {
      sum += weight;
      require(density.mean().allFinite() && density.covariance().allFinite(), "a component is not finite");
    }
    require(std::abs(sum - 1.0) < 1e-9, "weights do not sum to one");
    require(result.divergence >= 0.0 && result.dropped_weight >= 0.0, "a bound is negative or NaN");
    require(result.merged + result.dropped + static_cast<int>(result.mixture.size()) ==
                static_cast<int>(mixture.size()),
            "components got lost");
  });
}

}  // namespace

std::vector<Target> distribution_targets() {
  return {{"bingham", bingham}, {"bingham_fit", bingham_fit}, {"mixture_reduction", mixture_reduction}};
}

}  // namespace antipode::fuzz
