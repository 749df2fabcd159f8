// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include <antipode/detail/check.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/detail/cholesky.hpp>
#include <antipode/distributions/detail/merge_queue.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>

/// Fewer components for nearly the same mixture: light ones are dropped, similar ones merged (MPG sec. V).
///
/// Everything said here of divergences is exact for push-forward Gaussians on one tangent space; for
/// renormalised ones, and for changes of the tangent space, it holds to the order of tr Sigma_uu.
namespace antipode {

/// What the merging of two components costs.
enum class MergeCriterion {
  /// w log|S| - w_1 log|S_1| - w_2 log|S_2|, halved: bounds the Kullback-Leibler divergence from the mixture
  /// to the reduced one (A. R. Runnalls, "Kullback-Leibler approach to Gaussian mixture reduction", 2007).
  kRunnalls,
  /// w_1 d(p_1, p) + w_2 d(p, p_2) with the symmetric divergence d of MPG Eq. (23): bounds that of the
  /// mixtures. MPG Eq. (24) divides by w_1 + w_2, which makes it larger than need be.
  kSymmetricKullbackLeibler,
};

template <std::floating_point Scalar>
struct MixtureReductionOptions {
  std::size_t max_components = std::numeric_limits<std::size_t>::max();
  /// Lighter components are dropped.
  Scalar min_weight = 0;
  /// Beyond what max_components asks for, components are merged as long as the sum of costs stays within.
  Scalar max_divergence = 0;
  /// Components with tangent points further apart are not merged [rad on S^3].
  Scalar max_angle = std::numbers::pi_v<Scalar> / Scalar(12);
  MergeCriterion criterion = MergeCriterion::kRunnalls;
};

template <class Component>
struct MixtureReduction {
  using Scalar = typename Component::Scalar;

  Mixture<Component> mixture;
  int dropped = 0, merged = 0;
  /// No probability changes by more than this through dropping (half of what MPG has).
  Scalar dropped_weight = 0;
  /// Sum of the costs of merging.
  Scalar divergence = 0;
  /// No probability changes by more than this through all of it (Pinsker's inequality, step by step).
  Scalar probability_bound = 0;
};

namespace detail {

/// d_sKL of MPG Eq. (23), from roots of the covariances and the difference of the means: tr(S_2^-1 S_1 +
/// S_1^-1 S_2 + (S_1^-1 + S_2^-1) d d^T) / 2 - 6.
template <class Scalar>
[[nodiscard]] Scalar symmetric_kl(const Matrix6<Scalar>& L_1, const Matrix6<Scalar>& L_2,
                                  const Vector6<Scalar>& d) {
  const auto squares = [&](const Matrix6<Scalar>& L, const Matrix6<Scalar>& other) {
    return solve_lower<Scalar, 6, 6>(L, other).squaredNorm() + solve_lower<Scalar, 6, 1>(L, d).squaredNorm();
  };
  return std::max(Scalar(0), Scalar(0.5) * (squares(L_1, L_2) + squares(L_2, L_1)) - Scalar(6));
}

/// Mean and covariance of two weighted Gaussians on one tangent space.
template <class Scalar>
[[nodiscard]] TangentGaussian<Scalar> merge(Scalar w_1, const TangentGaussian<Scalar>& y_1, Scalar w_2,
                                            const TangentGaussian<Scalar>& y_2) {
  const Scalar a = w_1 / (w_1 + w_2), b = w_2 / (w_1 + w_2);
  const Vector6<Scalar> d = y_2.mean - y_1.mean;
  TangentGaussian<Scalar> merged{y_1.mean + b * d, a * y_1.covariance + b * y_2.covariance};
  add_outer_product(a * b, d, d, merged.covariance);
  return merged;
}

/// Two components on the tangent space at their weighted mean rotation, and merged there.
template <class Scalar>
struct MergedPair {
  Vector4<Scalar> tangent_point;
  TangentGaussian<Scalar> first, second, merged;

  template <Projection kProjection>
  MergedPair(Scalar w_1, const BasicProjectedGaussian<Scalar, kProjection>& p_1, Scalar w_2,
             const BasicProjectedGaussian<Scalar, kProjection>& p_2) {
    const Vector4<Scalar>&q_1 = p_1.tangent_point(), &q_2 = p_2.tangent_point();
    const Scalar sign = q_1.dot(q_2) < Scalar(0) ? Scalar(-1) : Scalar(1);
    tangent_point = (w_1 * q_1 + sign * w_2 * q_2).normalized();
    first = ChartChange<Scalar>(q_1, tangent_point).linearized(p_1.parameters());
    second = ChartChange<Scalar>(q_2, tangent_point).linearized(p_2.parameters());
    merged = merge(w_1, first, w_2, second);
  }
};

/// The cost of a merger; infinite if a covariance is singular.
template <class Scalar>
[[nodiscard]] Scalar merge_cost(MergeCriterion criterion, Scalar w_1, Scalar w_2,
                                const MergedPair<Scalar>& pair) {
  const auto L_1 = cholesky_factor(pair.first.covariance);
  const auto L_2 = cholesky_factor(pair.second.covariance);
  const auto L = cholesky_factor(pair.merged.covariance);
  if (!L_1 || !L_2 || !L) return std::numeric_limits<Scalar>::infinity();
  if (criterion == MergeCriterion::kRunnalls) {
    // gaussian_log_peak is -log|S|/2 and a constant, which cancels.
    const Scalar cost = w_1 * (gaussian_log_peak(*L_1) - gaussian_log_peak(*L)) +
                        w_2 * (gaussian_log_peak(*L_2) - gaussian_log_peak(*L));
    return std::max(Scalar(0), cost);
  }
  return w_1 * symmetric_kl<Scalar>(*L_1, *L, pair.merged.mean - pair.first.mean) +
         w_2 * symmetric_kl<Scalar>(*L, *L_2, pair.merged.mean - pair.second.mean);
}

/// A number that neither criterion's cost is below, from the translations alone, which no change of tangent
/// space touches: w/2 log(1 + w_1 w_2/w^2 d_k^2/A_kk) for each coordinate k, with A the mean covariance.
template <class Scalar, Projection kProjection>
[[nodiscard]] Scalar merge_cost_bound(Scalar w_1, const BasicProjectedGaussian<Scalar, kProjection>& p_1,
                                      Scalar w_2, const BasicProjectedGaussian<Scalar, kProjection>& p_2) {
  using std::log1p;
  const Scalar w = w_1 + w_2;
  Scalar largest(0);
  for (int k = 3; k < 6; ++k) {
    const Scalar d = p_2.mean()[k] - p_1.mean()[k];
    const Scalar within = w_1 * p_1.covariance()(k, k) + w_2 * p_2.covariance()(k, k);
    if (within > Scalar(0)) largest = std::max(largest, d * d / within);
  }
  return Scalar(0.5) * w * log1p(w_1 * w_2 / w * largest);
}

}  // namespace detail

/// The symmetric Kullback-Leibler divergence (Jeffreys) of two densities, MPG Eq. (23), both restated half
/// way between their tangent points. Throws std::domain_error if a covariance is singular.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] Scalar symmetric_kl_divergence(const BasicProjectedGaussian<Scalar, kProjection>& a,
                                             const BasicProjectedGaussian<Scalar, kProjection>& b) {
  const detail::MergedPair<Scalar> pair(Scalar(0.5), a, Scalar(0.5), b);
  const auto L_a = detail::cholesky_factor(pair.first.covariance);
  const auto L_b = detail::cholesky_factor(pair.second.covariance);
  if (!L_a || !L_b) [[unlikely]] {
    throw std::domain_error("a projected Gaussian with a singular covariance has no divergences");
  }
  return detail::symmetric_kl<Scalar>(*L_a, *L_b, pair.second.mean - pair.first.mean);
}

/// The component with the moments of two weighted ones (the p' of MPG Eq. 24), centred at its mode.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] BasicProjectedGaussian<Scalar, kProjection> merge(
    Scalar w_1, const BasicProjectedGaussian<Scalar, kProjection>& p_1, Scalar w_2,
    const BasicProjectedGaussian<Scalar, kProjection>& p_2) {
  const detail::MergedPair<Scalar> pair(w_1, p_1, w_2, p_2);
  const auto y = detail::centered(pair.merged);
  return {detail::central_projection<Scalar>(pair.tangent_point, pair.merged.mean.template head<3>()), y.mean,
          y.covariance};
}

/// The mixture with fewer components: those lighter than min_weight are dropped; then the pair that costs
/// least is merged, time and again, until max_components are left and max_divergence is used up. If more than
/// max_components are left that lie too far apart to merge, the lightest are dropped.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] MixtureReduction<BasicProjectedGaussian<Scalar, kProjection>> reduce(
    const Mixture<BasicProjectedGaussian<Scalar, kProjection>>& x,
    const MixtureReductionOptions<Scalar>& options = {}) {
  using Component = BasicProjectedGaussian<Scalar, kProjection>;
  using std::abs;
  using std::cos;
  using std::sqrt;
  if (options.max_components == 0 || !(options.min_weight >= Scalar(0) && options.min_weight < Scalar(1)))
      [[unlikely]] {
    detail::throw_invalid("a reduction that leaves no component, max_components or min_weight",
                          options.max_components == 0 ? Scalar(0) : options.min_weight);
  }
  MixtureReduction<Component> result{.mixture = x};
  std::vector<typename Mixture<Component>::Element> alive;
  alive.reserve(x.size());
  for (const auto& [weight, density] : x) {
    if (weight < options.min_weight && weight < x.heaviest().weight) {
      result.dropped_weight += weight;
      ++result.dropped;
    } else {
      alive.push_back({weight, density.centered()});
    }
  }
  for (auto& element : alive) element.weight /= Scalar(1) - result.dropped_weight;

  const Scalar min_cosine = cos(options.max_angle);
  const auto bound = [&](std::size_t i, std::size_t j) {
    const auto& [w_1, p_1] = alive[i];
    const auto& [w_2, p_2] = alive[j];
    const bool near = abs(p_1.tangent_point().dot(p_2.tangent_point())) >= min_cosine;
    return near ? detail::merge_cost_bound(w_1, p_1, w_2, p_2) : std::numeric_limits<Scalar>::infinity();
  };
  const auto cost = [&](std::size_t i, std::size_t j) {
    const auto& [w_1, p_1] = alive[i];
    const auto& [w_2, p_2] = alive[j];
    return detail::merge_cost(options.criterion, w_1, w_2, detail::MergedPair<Scalar>(w_1, p_1, w_2, p_2));
  };
  detail::MergeQueue<Scalar> queue(alive.size(), bound);
  while (const auto best = queue.cheapest(cost)) {
    const bool affordable =
        options.max_divergence > Scalar(0) && result.divergence + best->cost <= options.max_divergence;
    if (!affordable && queue.size() <= options.max_components) break;
    auto& [w_1, p_1] = alive[best->i];
    const auto& [w_2, p_2] = alive[best->j];
    p_1 = merge(w_1, p_1, w_2, p_2);
    w_1 += w_2;
    queue.merge(best->i, best->j, bound);
    result.divergence += best->cost;
    const bool symmetric = options.criterion == MergeCriterion::kSymmetricKullbackLeibler;
    result.probability_bound += sqrt(best->cost / Scalar(symmetric ? 4 : 2));
    ++result.merged;
  }

  std::vector<typename Mixture<Component>::Element> kept;
  kept.reserve(queue.size());
  for (std::size_t i = 0; i < alive.size(); ++i) {
    if (queue.alive(i)) kept.push_back(std::move(alive[i]));
  }
  while (kept.size() > options.max_components) {
    const auto lightest = std::min_element(kept.begin(), kept.end(),
                                           [](const auto& a, const auto& b) { return a.weight < b.weight; });
    result.dropped_weight += lightest->weight;
    ++result.dropped;
    kept.erase(lightest);
  }
  result.probability_bound += result.dropped_weight;
  result.mixture = Mixture<Component>::normalized(std::move(kept));
  return result;
}

}  // namespace antipode
