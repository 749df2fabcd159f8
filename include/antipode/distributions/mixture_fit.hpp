// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <antipode/detail/check.hpp>
#include <antipode/distributions/detail/mixture_em.hpp>
#include <antipode/distributions/detail/pose_seeding.hpp>
#include <antipode/distributions/detail/tangent_moments.hpp>
#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// Mixtures of projected Gaussians from samples, by expectation maximisation (MPG sec. IV).
///
/// The fitted components are push-forward Gaussians, because EM maximises their likelihood;
/// match_renormalized converts them to the other kind. Equal samples and an equal state of the random engine
/// give equal fits, bit for bit.
namespace antipode {

/// How long expectation maximisation searches, and how narrow a component may become.
struct MixtureFitOptions {
  /// Number of k-means++ starts; the best after screening_iterations is followed to the end.
  int restarts = 4;
  int screening_iterations = 12;  ///< of every start, before the best is chosen
  int max_iterations = 200;       ///< of the best start, those of the screening included
  /// Converged if an iteration adds less than this, per sample, to the log-likelihood.
  double tolerance = 1e-6;
  double min_sigma_u = 1e-4;        ///< smallest standard deviation of u
  double min_sigma_t_ratio = 1e-4;  ///< smallest one of t, relative to that of all samples
  /// fit_mixture_by_bic stops when this many successive numbers of components have not improved the best BIC.
  int patience = 2;
};

/// The result of a fit.
template <class Scalar>
struct MixtureFit {
  Mixture<PushForwardGaussian<Scalar>> mixture;  ///< each component centred at its mode
  Scalar log_likelihood = 0;                     ///< of N = (sum w)^2 / sum w^2 samples
  Scalar bic = 0;                                ///< -2 log_likelihood + (28 n - 1) log N, n components
  int iterations = 0;                            ///< of the start that was followed to the end
  bool converged = false;  ///< whether the last iteration gained less than the tolerance
  /// Largest decrease of the log-likelihood in an iteration that moved no tangent point: rounding errors.
  Scalar largest_decrease = 0;
  /// The same for iterations in which a tangent point moved to its mode at u, or a component started again.
  /// The component is then Gaussian in other coordinates, and EM does not guarantee an increase. Near
  /// convergence the decrease is about |u| sigma_u sqrt(35 N) for N samples of a Gaussian, with |u| below
  /// 1e-3.
  Scalar largest_rebasing_decrease = 0;
  int reseeded = 0;  ///< components that lost their samples and started again
};

namespace detail {

/// (sum w)^2 / sum w^2: the effective sample size, the number of equal weights with the same effect.
template <class Scalar>
[[nodiscard]] Scalar effective_count(const Weights<Scalar>& weights) {
  const Scalar sum = checked_sum<Scalar>(weights);
  return Scalar(1) / (weights / sum).squaredNorm();
}

template <class Scalar>
struct EmRun {
  MixtureEm<Scalar> em;
  Scalar log_likelihood = -std::numeric_limits<Scalar>::infinity();
  Scalar largest_decrease = 0, largest_rebasing_decrease = 0;
  int iterations = 0;
  bool converged = false;

  void iterate(int max_iterations, Scalar tolerance) {
    for (; iterations < max_iterations && !converged; ++iterations) {
      const bool stayed = iterations == 0 || em.maximize();
      const Scalar previous = std::exchange(log_likelihood, em.expect());
      if (!(previous > -std::numeric_limits<Scalar>::infinity())) continue;
      Scalar& largest = stayed ? largest_decrease : largest_rebasing_decrease;
      largest = std::max(largest, previous - log_likelihood);
      converged = std::abs(log_likelihood - previous) < tolerance;
    }
  }
};

template <class Scalar, class Rng>
[[nodiscard]] MixtureFit<Scalar> fit_mixture(const PoseSample<Scalar>& sample, std::size_t components,
                                             Rng& rng, const MixtureFitOptions& options) {
  using Fitted = Mixture<PushForwardGaussian<Scalar>>;
  const PoseMetric<Scalar> metric(sample);
  const Scalar count = sample.weights.sum();
  const Scalar sigma_t =
      static_cast<Scalar>(options.min_sigma_t_ratio) * std::sqrt(metric.translation_variance());
  const CovarianceFloor<Scalar> floor(static_cast<Scalar>(options.min_sigma_u),
                                      std::max(sigma_t, Scalar(1e-9)));
  const Scalar tolerance = static_cast<Scalar>(options.tolerance) * count;
  std::optional<EmRun<Scalar>> best;
  const int restarts = components == 1 ? 1 : options.restarts;
  for (int restart = 0; restart < restarts; ++restart) {
    const auto clusters = seed_clusters(sample, metric, components, restart == 0, rng);
    EmRun<Scalar> run{MixtureEm<Scalar>(sample, floor, clusters, components)};
    run.iterate(options.screening_iterations, tolerance);
    if (!best || run.log_likelihood > best->log_likelihood) best.emplace(std::move(run));
  }
  best->iterate(options.max_iterations, tolerance);

  std::vector<typename Fitted::Element> elements;
  for (const auto& component : best->em.components()) {
    const PushForwardGaussian<Scalar> density(component.q.normalized(), component.y.mean,
                                              component.y.covariance);
    elements.push_back({component.weight, density.centered()});
  }
  MixtureFit<Scalar> fit{.mixture = Fitted::normalized(std::move(elements))};
  const Scalar parameters = Scalar(28) * Scalar(fit.mixture.size()) - Scalar(1);
  fit.log_likelihood = best->log_likelihood;
  fit.bic = Scalar(-2) * fit.log_likelihood + parameters * std::log(count);
  fit.iterations = best->iterations;
  fit.converged = best->converged;
  fit.largest_decrease = best->largest_decrease;
  fit.largest_rebasing_decrease = best->largest_rebasing_decrease;
  fit.reseeded = best->em.reseeded();
  return fit;
}

/// The samples, with weights that sum to their effective sample size. Throws on invalid options and if there
/// are fewer samples than components.
template <class Scalar>
[[nodiscard]] PoseSample<Scalar> checked_sample(const PoseColumns<Scalar>& poses,
                                                const Weights<Scalar>& weights, std::size_t components,
                                                const MixtureFitOptions& options) {
  if (options.restarts < 1 || options.max_iterations < 1) [[unlikely]] {
    throw_invalid("restarts and iterations of a fit must be positive, smallest",
                  std::min(options.restarts, options.max_iterations));
  }
  if (components < 1 || static_cast<Eigen::Index>(components) > weights.size()) [[unlikely]] {
    throw_invalid("a fit needs a component, and a sample for each, components", components);
  }
  return {poses, weights, effective_count<Scalar>(weights)};
}

}  // namespace detail

/// The maximum-likelihood mixture of so many components (fewer if some lose their samples) for weighted
/// poses, the columns [q; p] of either sign; the weights need not be normalised. EM finds a local maximum,
/// the best of several starts. Throws on weights that are negative or sum to zero, on anything not finite, on
/// invalid options, and if there are fewer samples than components.
template <class Points, class Weights, std::uniform_random_bit_generator Rng>
requires(Points::RowsAtCompileTime == 8)
    [[nodiscard]] MixtureFit<typename Points::Scalar> fit_mixture(const Eigen::MatrixBase<Points>& points,
                                                                  const Eigen::MatrixBase<Weights>& weights,
                                                                  std::size_t components, Rng& rng,
                                                                  const MixtureFitOptions& options = {}) {
  using Scalar = typename Points::Scalar;
  return detail::fit_mixture(detail::checked_sample<Scalar>(points, weights, components, options), components,
                             rng, options);
}

/// The fit with the least BIC among those with 1, 2, ..., max_components components. Throws as fit_mixture
/// does.
template <class Points, class Weights, std::uniform_random_bit_generator Rng>
requires(Points::RowsAtCompileTime == 8) [[nodiscard]] MixtureFit<typename Points::Scalar> fit_mixture_by_bic(
    const Eigen::MatrixBase<Points>& points, const Eigen::MatrixBase<Weights>& weights,
    std::size_t max_components, Rng& rng, const MixtureFitOptions& options = {}) {
  using Scalar = typename Points::Scalar;
  const auto sample = detail::checked_sample<Scalar>(points, weights, max_components, options);
  auto best = detail::fit_mixture(sample, 1, rng, options);
  int failures = 0;
  for (std::size_t n = 2; n <= max_components && failures < options.patience; ++n) {
    auto fit = detail::fit_mixture(sample, n, rng, options);
    ++failures;
    if (fit.bic < best.bic) {
      best = std::move(fit);
      failures = 0;
    }
  }
  return best;
}

}  // namespace antipode
