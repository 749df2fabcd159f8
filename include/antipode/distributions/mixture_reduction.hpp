// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <antipode/detail/check.hpp>
#include <antipode/distributions/component_merging.hpp>
#include <antipode/distributions/detail/merge_screen.hpp>
#include <antipode/distributions/detail/merge_table.hpp>
#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// Fewer components for nearly the same mixture: light ones are dropped, similar ones merged (MPG sec. V).
namespace antipode {

/// How many components reduce() leaves, and how large the change may be.
template <std::floating_point Scalar>
struct MixtureReductionOptions {
  /// Most components that are left; at least 1.
  std::size_t max_components = std::numeric_limits<std::size_t>::max();
  /// Lighter components are dropped. The heaviest one always stays.
  Scalar min_weight = 0;
  /// With max_components or fewer left, merging continues while the sum of all costs [nats] is at most this.
  /// With 0 it stops at max_components.
  Scalar max_divergence = 0;
  /// Components with tangent points further apart are not merged [rad on S^3, half the angle of the
  /// rotation].
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
  /// Sum of the dropped weights. Dropping changes no probability by more (MPG has twice this bound).
  Scalar dropped_weight = 0;
  /// Sum of the costs of merging [nats].
  Scalar divergence = 0;
  /// Dropping and merging together change no probability by more (Pinsker's inequality for every merge).
  Scalar probability_bound = 0;
};

namespace detail {

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

/// Merges the components of a mixture until the options ask for no more.
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
  /// Up to this many components the costs of all pairs are exact. With more, MergeScreen chooses the pairs.
  static constexpr std::size_t kExhaustive = 128;

  /// Sets the variances that are added to all components before costs are compared, if a covariance is
  /// singular: 1e-12 (1e-5 in single precision) of the mean variance over all components, or of 1 (u) and
  /// 1 m^2 (t) where it is zero. Without them, divergences from singular densities are infinite; with them,
  /// they tell which components are alike.
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

  /// Whether the options ask for a merge of this cost while so many components are left.
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

  /// Removes the components that were merged into others.
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
  std::vector<Element> widened_;  ///< the same with floor_ added, all regular: for the costs
  Vector6<Scalar> floor_ = Vector6<Scalar>::Zero();
};

}  // namespace detail

/// The mixture with fewer components. Those lighter than min_weight are dropped. Then the pair that costs
/// least is merged, repeatedly, until max_components are left and max_divergence is used up. If more than
/// max_components are left that lie too far apart to merge, the lightest are dropped.
///
/// Components of singular covariances, a plane say, merge too: at no cost with copies of themselves, at a
/// finite but large cost with others. With more than 128 components, pairs are chosen by their cost to first
/// order in the angle between them; 2000 components take a third of a second. Throws on invalid options.
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
