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
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/detail/merge_screen.hpp>
#include <antipode/distributions/detail/merge_table.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// Fewer components for nearly the same mixture: light ones are dropped, similar ones merged (MPG sec. V).
///
/// The divergences are exact for push-forward Gaussians on one tangent space; for
/// renormalised ones, and for changes of the tangent space, they hold to the order of tr Sigma_uu.
namespace antipode {

/// What the merging of two components costs.
enum class MergeCriterion {
  /// w log|S| - w_1 log|S_1| - w_2 log|S_2|, halved: bounds the Kullback-Leibler divergence from the mixture
  /// to the reduced one (Runnalls, "Kullback-Leibler approach to Gaussian mixture reduction", 2007).
  kRunnalls,
  /// w_1 d(p_1, p) + w_2 d(p, p_2) with the symmetric divergence d of MPG Eq. (23): bounds that of the
  /// mixtures. MPG Eq. (24) divides by w_1 + w_2, which makes it larger than need be.
  kSymmetricKullbackLeibler,
};

/// How many components are left, and what may be lost with the others.
template <std::floating_point Scalar>
struct MixtureReductionOptions {
  /// Most components that are left; at least 1.
  std::size_t max_components = std::numeric_limits<std::size_t>::max();
  /// Lighter components are dropped.
  Scalar min_weight = 0;
  /// Beyond what max_components asks for, components are merged as long as the sum of costs stays within.
  Scalar max_divergence = 0;
  /// Components with tangent points further apart are not merged [rad on S^3].
  Scalar max_angle = std::numbers::pi_v<Scalar> / Scalar(12);
  MergeCriterion criterion = MergeCriterion::kRunnalls;  ///< what the merging of a pair costs
};

/// The result of reduce(), and what was lost.
template <class Component>
struct MixtureReduction {
  using Scalar = typename Component::Scalar;  ///< of weights and densities

  Mixture<Component> mixture;  ///< what is left
  int dropped = 0,             ///< number of components that were dropped
      merged = 0;              ///< number of merges of two components
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
  Scalar log_peak_1 = 0, log_peak_2 = 0;  ///< -log|S_i|/2 and a constant

  template <Projection kProjection>
  MergedPair(Scalar w_1, const BasicProjectedGaussian<Scalar, kProjection>& p_1, Scalar w_2,
             const BasicProjectedGaussian<Scalar, kProjection>& p_2) {
    const Vector4<Scalar>&q_1 = p_1.tangent_point(), &q_2 = p_2.tangent_point();
    const Scalar sign = q_1.dot(q_2) < Scalar(0) ? Scalar(-1) : Scalar(1);
    tangent_point = (w_1 * q_1 + sign * w_2 * q_2).normalized();
    const ChartChange<Scalar> from_1(q_1, tangent_point), from_2(q_2, tangent_point);
    first = from_1.linearized(p_1.parameters());
    second = from_2.linearized(p_2.parameters());
    merged = merge(w_1, first, w_2, second);
    log_peak_1 = p_1.gaussian_log_peak() - from_1.log_determinant(p_1.mean().template head<3>());
    log_peak_2 = p_2.gaussian_log_peak() - from_2.log_determinant(p_2.mean().template head<3>());
  }
};

/// The cost of merging two components of regular covariances.
template <class Scalar>
[[nodiscard]] Scalar merge_cost(MergeCriterion criterion, Scalar w_1, Scalar w_2,
                                const MergedPair<Scalar>& pair) {
  constexpr Scalar kInfinity = std::numeric_limits<Scalar>::infinity();
  const auto L = cholesky_factor(pair.merged.covariance);
  if (!L) return kInfinity;
  if (criterion == MergeCriterion::kRunnalls) {
    const Scalar log_peak = gaussian_log_peak(*L);
    return std::max(Scalar(0), w_1 * (pair.log_peak_1 - log_peak) + w_2 * (pair.log_peak_2 - log_peak));
  }
  const auto L_1 = cholesky_factor(pair.first.covariance);
  const auto L_2 = cholesky_factor(pair.second.covariance);
  if (!L_1 || !L_2) return kInfinity;
  return w_1 * symmetric_kl<Scalar>(*L_1, *L, pair.merged.mean - pair.first.mean) +
         w_2 * symmetric_kl<Scalar>(*L, *L_2, pair.merged.mean - pair.second.mean);
}

/// The marginal of the translation, which no change of tangent space touches.
template <class Scalar>
struct TranslationMarginal {
  Vector3<Scalar> mean;
  Matrix3<Scalar> covariance;
  Scalar log_determinant;

  template <Projection kProjection>
  explicit TranslationMarginal(const BasicProjectedGaussian<Scalar, kProjection>& p)
      : mean(p.mean().template tail<3>()),
        covariance(p.covariance().template bottomRightCorner<3, 3>()),
        log_determinant(std::log(covariance.determinant())) {}
};

/// Runnalls' cost for the translations alone. Marginals are no further apart than the densities, so that the
/// cost of merging these is not below, by either criterion.
template <class Scalar>
[[nodiscard]] Scalar merge_cost_bound(Scalar w_1, const TranslationMarginal<Scalar>& p_1, Scalar w_2,
                                      const TranslationMarginal<Scalar>& p_2) {
  using std::log;
  const Scalar a = w_1 / (w_1 + w_2), b = w_2 / (w_1 + w_2);
  const Vector3<Scalar> d = p_2.mean - p_1.mean;
  Matrix3<Scalar> merged = a * p_1.covariance + b * p_2.covariance;
  add_outer_product(a * b, d, d, merged);
  const Scalar log_determinant = log(merged.determinant());
  return Scalar(0.5) *
         (w_1 * (log_determinant - p_1.log_determinant) + w_2 * (log_determinant - p_2.log_determinant));
}

/// The components of `x` but those lighter than `min_weight`, centred and with weights that sum to one. The
/// heaviest is always kept. `result` counts what is dropped.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] auto without_light_components(
    const Mixture<BasicProjectedGaussian<Scalar, kProjection>>& x, Scalar min_weight,
    MixtureReduction<BasicProjectedGaussian<Scalar, kProjection>>& result) {
  std::vector<typename Mixture<BasicProjectedGaussian<Scalar, kProjection>>::Element> kept;
  kept.reserve(x.size());
  for (const auto& [weight, density] : x) {
    if (weight < min_weight && weight < x.heaviest().weight) {
      result.dropped_weight += weight;
      ++result.dropped;
    } else {
      kept.push_back({weight, density.centered()});
    }
  }
  for (auto& element : kept) element.weight /= Scalar(1) - result.dropped_weight;
  return kept;
}

/// Drops the lightest components until `max_components` are left. `result` counts what is dropped.
template <class Element, class Reduction>
void drop_lightest(std::size_t max_components, std::vector<Element>& components, Reduction& result) {
  while (components.size() > max_components) {
    const auto lightest = std::min_element(components.begin(), components.end(),
                                           [](const auto& a, const auto& b) { return a.weight < b.weight; });
    result.dropped_weight += lightest->weight;
    ++result.dropped;
    components.erase(lightest);
  }
}

/// Throws unless the options make sense.
template <class Scalar>
void check_options(const MixtureReductionOptions<Scalar>& options) {
  if (options.max_components == 0 || !(options.min_weight >= Scalar(0) && options.min_weight < Scalar(1)))
      [[unlikely]] {
    throw_invalid("a reduction that leaves no component, max_components or min_weight",
                  options.max_components == 0 ? Scalar(0) : options.min_weight);
  }
  if (!(options.max_divergence >= Scalar(0))) [[unlikely]] {
    throw_invalid("max_divergence is negative or NaN", options.max_divergence);
  }
  if (!(options.max_angle >= Scalar(0))) [[unlikely]] {
    throw_invalid("max_angle is negative or NaN [rad]", options.max_angle);
  }
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

namespace detail {

/// The components of a mixture while their number goes down.
template <class Component>
class ComponentMerger {
 public:
  using Scalar = typename Component::Scalar;
  using Element = typename Mixture<Component>::Element;
  using Options = MixtureReductionOptions<Scalar>;

  ComponentMerger(std::vector<Element> components, const Options& options,
                  MixtureReduction<Component>& result)
      : options_(options), result_(result), components_(std::move(components)) {
    const bool all_regular = std::all_of(components_.begin(), components_.end(),
                                         [](const Element& c) { return c.density.positive_definite(); });
    if (!all_regular) set_floor();
    widened_.reserve(components_.size());
    for (const Element& c : components_) widened_.push_back({c.weight, widened(c.density)});
  }

  /// What is left when the options ask for no more merging.
  [[nodiscard]] std::vector<Element> reduced() {
    if (components_.size() > kExhaustive) merge_many();
    if (components_.size() <= kExhaustive) merge_few();
    return std::move(components_);
  }

 private:
  /// Up to that many components all pairs are compared exactly; more, by MergeScreen.
  static constexpr std::size_t kExhaustive = 128;

  /// Variances that are added before costs are compared if there are singular components: 1e-12 (1e-5 in
  /// single precision) of the mean over all components, or of 1 and 1 m^2 where all are zero. A divergence
  /// from a singular density is infinite; one from a very flat one tells which of them are alike.
  void set_floor() {
    constexpr Scalar kShare = std::max(Scalar(1e-12), Scalar(100) * std::numeric_limits<Scalar>::epsilon());
    Vector6<Scalar> mean = Vector6<Scalar>::Zero();
    for (const Element& c : components_) mean += c.weight * c.density.covariance().diagonal();
    for (int block = 0; block < 2; ++block) {
      const Scalar variance = mean.template segment<3>(3 * block).sum() / Scalar(3);
      floor_.template segment<3>(3 * block).setConstant(kShare *
                                                        (variance > Scalar(0) ? variance : Scalar(1)));
    }
  }

  [[nodiscard]] Component widened(const Component& x) const {
    if (floor_.isZero(Scalar(0))) return x;
    Matrix6<Scalar> covariance = x.covariance();
    covariance.diagonal() += floor_;
    return {x.tangent_point(), x.mean(), covariance};
  }

  [[nodiscard]] Scalar cost(std::size_t i, std::size_t j) const {
    const auto& [w_1, p_1] = widened_[i];
    const auto& [w_2, p_2] = widened_[j];
    return merge_cost(options_.criterion, w_1, w_2, MergedPair<Scalar>(w_1, p_1, w_2, p_2));
  }

  /// Whether a merge of this cost is asked for while so many components are left.
  [[nodiscard]] bool wanted(Scalar cost, std::size_t components) const {
    const bool affordable =
        options_.max_divergence > Scalar(0) && result_.divergence + cost <= options_.max_divergence;
    return affordable || components > options_.max_components;
  }

  /// Component i becomes the merge of both.
  void merge_into(std::size_t i, std::size_t j, Scalar cost) {
    using std::sqrt;
    auto& [w_1, p_1] = components_[i];
    const auto& [w_2, p_2] = components_[j];
    p_1 = merge(w_1, p_1, w_2, p_2);
    w_1 += w_2;
    widened_[i] = {w_1, widened(p_1)};
    result_.divergence += cost;
    const bool symmetric = options_.criterion == MergeCriterion::kSymmetricKullbackLeibler;
    result_.probability_bound += sqrt(cost / Scalar(symmetric ? 4 : 2));
    ++result_.merged;
  }

  /// Forgets the components that are part of others now.
  void remove(const std::vector<bool>& gone) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < components_.size(); ++i) {
      if (gone[i]) continue;
      components_[count] = components_[i];
      widened_[count++] = widened_[i];
    }
    components_.erase(components_.begin() + static_cast<std::ptrdiff_t>(count), components_.end());
    widened_.erase(widened_.begin() + static_cast<std::ptrdiff_t>(count), widened_.end());
  }

  [[nodiscard]] Scalar min_cosine() const {
    return std::cos(std::min(options_.max_angle, std::numbers::pi_v<Scalar> / Scalar(2)));
  }

  /// Merges until kExhaustive components are left.
  void merge_many() {
    MergeScreen<Component> pairs(widened_, min_cosine());
    std::vector<bool> gone(components_.size());
    while (pairs.size() > kExhaustive) {
      const auto best = pairs.cheapest();
      if (!best) break;
      const Scalar price = cost(best->i, best->j);
      if (!wanted(price, pairs.size())) break;
      merge_into(best->i, best->j, price);
      gone[best->j] = true;
      pairs.merge_cheapest(widened_[best->i].weight, widened_[best->i].density);
    }
    remove(gone);
  }

  void merge_few() {
    using std::abs;
    std::vector<TranslationMarginal<Scalar>> translations;
    translations.reserve(widened_.size());
    for (const Element& c : widened_) translations.emplace_back(c.density);
    const auto bound = [&](std::size_t i, std::size_t j) {
      const auto& [w_1, p_1] = widened_[i];
      const auto& [w_2, p_2] = widened_[j];
      const bool near = abs(p_1.tangent_point().dot(p_2.tangent_point())) >= min_cosine();
      return near ? merge_cost_bound(w_1, translations[i], w_2, translations[j])
                  : std::numeric_limits<Scalar>::infinity();
    };
    MergeTable<Scalar> pairs(widened_.size(), bound);
    std::vector<bool> gone(components_.size());
    while (const auto best = pairs.cheapest([&](std::size_t i, std::size_t j) { return cost(i, j); })) {
      if (!wanted(best->cost, pairs.size())) break;
      merge_into(best->i, best->j, best->cost);
      translations[best->i] = TranslationMarginal<Scalar>(widened_[best->i].density);
      gone[best->j] = true;
      pairs.merge(best->i, best->j, bound);
    }
    remove(gone);
  }

  const Options& options_;
  MixtureReduction<Component>& result_;
  std::vector<Element> components_;
  std::vector<Element> widened_;  ///< the same, all regular: what costs are worked out of
  Vector6<Scalar> floor_ = Vector6<Scalar>::Zero();
};

}  // namespace detail

/// The mixture with fewer components: those lighter than min_weight are dropped; then the pair that costs
/// least is merged, time and again, until max_components are left and max_divergence is used up. If more than
/// max_components are left that lie too far apart to merge, the lightest are dropped.
///
/// Components of singular covariances, a plane say, merge too: at no cost with copies of themselves, at a
/// finite but large one with others. Of more than 128 components the pairs are chosen by their cost to first
/// order in the angle between them; 2000 take a third of a second. Throws on invalid options.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] MixtureReduction<BasicProjectedGaussian<Scalar, kProjection>> reduce(
    const Mixture<BasicProjectedGaussian<Scalar, kProjection>>& x,
    const MixtureReductionOptions<Scalar>& options = {}) {
  using Component = BasicProjectedGaussian<Scalar, kProjection>;
  detail::check_options(options);
  MixtureReduction<Component> result{.mixture = x};
  auto kept = detail::ComponentMerger<Component>(
                  detail::without_light_components(x, options.min_weight, result), options, result)
                  .reduced();
  detail::drop_lightest(options.max_components, kept, result);
  result.probability_bound += result.dropped_weight;
  result.mixture = Mixture<Component>::normalized(std::move(kept));
  return result;
}

}  // namespace antipode
