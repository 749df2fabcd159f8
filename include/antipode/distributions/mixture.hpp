// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <antipode/detail/check.hpp>
#include <antipode/distributions/detail/agreement.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/distributions/projected_gaussian_operations.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// Mixtures of densities, their fusion and composition.
namespace antipode {

/// A convex combination of densities of one kind.
///
///     p(x) = sum_i pi_i p_i(x),   pi_i >= 0,   sum_i pi_i = 1
///
/// The paper's Eqs. (18), (19) and (21) have an additional factor 1/n, with which p would integrate to 1/n.
/// Any component with a member type Scalar can be mixed. A mixture supports those of log_density, sample,
/// fuse, compose and inverse that its components support. MPG's mixtures are
/// Mixture<ProjectedGaussian<double>>. Reference: MPG sec. III-D.
template <class Component_>
class Mixture {
 public:
  using Component = Component_;               ///< the density that is mixed
  using Scalar = typename Component::Scalar;  ///< of weights and densities

  /// A component with its weight.
  struct Element {
    Scalar weight;      ///< pi_i, not negative
    Component density;  ///< p_i
  };

  /// A mixture of one component.
  template <std::same_as<Component> Single>
  Mixture(const Single& density) : elements_{{Scalar(1), density}} {}

  /// Throws unless there is a component and the weights are non-negative and sum to one within 1e-6. They are
  /// then normalised.
  explicit Mixture(std::vector<Element> elements) : Mixture(std::move(elements), kWeightTolerance) {}

  /// The weights divided by their sum, which must be positive and finite.
  [[nodiscard]] static Mixture normalized(std::vector<Element> elements) {
    return Mixture(std::move(elements), std::numeric_limits<Scalar>::infinity());
  }

  /// The number of components.
  [[nodiscard]] std::size_t size() const noexcept { return elements_.size(); }
  /// All components, in the order they were given in.
  [[nodiscard]] const std::vector<Element>& elements() const noexcept { return elements_; }
  /// Component i, from 0; not checked.
  [[nodiscard]] const Element& operator[](std::size_t i) const { return elements_[i]; }
  /// The first component: a mixture is a range of its elements.
  [[nodiscard]] auto begin() const noexcept { return elements_.begin(); }
  /// Behind the last component.
  [[nodiscard]] auto end() const noexcept { return elements_.end(); }

  /// The component with the largest weight; of equals, the first.
  [[nodiscard]] const Element& heaviest() const {
    return *std::max_element(begin(), end(),
                             [](const Element& a, const Element& b) { return a.weight < b.weight; });
  }

  /// log sum_i pi_i p_i(x). NaN if the density of a component with weight is.
  template <class Point>
  requires requires(const Component& density, const Point& x) { density.log_density(x); }
  [[nodiscard]] Scalar log_density(const Point& x) const {
    using std::exp;
    using std::log;
    constexpr Scalar kInfinity = std::numeric_limits<Scalar>::infinity();
    Scalar largest = -kInfinity, sum(0);  // sum of exp(value - largest) so far
    for (const Element& element : elements_) {
      if (!(element.weight > Scalar(0))) continue;
      const Scalar value = log(element.weight) + element.density.log_density(x);
      if (value > largest) {
        sum = sum * exp(largest - value) + Scalar(1);
        largest = value;
      } else if (!(value == -kInfinity)) {
        sum += exp(value - largest);  // NaN stays NaN
      }
    }
    return largest + log(sum);
  }

  /// An exact draw, from a component that is drawn by its weight.
  template <std::uniform_random_bit_generator Rng>
  [[nodiscard]] auto sample(Rng& rng) const {
    Scalar remaining = std::uniform_real_distribution<Scalar>()(rng);
    std::size_t i = 0;
    while (i + 1 < size() && remaining >= elements_[i].weight) remaining -= elements_[i++].weight;
    return elements_[i].density.sample(rng);
  }

 private:
  static constexpr Scalar kWeightTolerance =
      std::max(Scalar(1e-6), Scalar(64) * std::numeric_limits<Scalar>::epsilon());

  Mixture(std::vector<Element> elements, Scalar tolerance) : elements_(std::move(elements)) {
    using std::abs;
    Scalar sum(0);
    for (const Element& element : elements_) {
      if (!(element.weight >= Scalar(0))) [[unlikely]] {
        detail::throw_invalid("weight of a mixture's component is negative or not a number", element.weight);
      }
      sum += element.weight;
    }
    if (elements_.empty()) [[unlikely]] {
      detail::throw_invalid("a mixture needs components; their number", 0);
    }
    if (!(sum > Scalar(0)) || !std::isfinite(sum) || !(abs(sum - Scalar(1)) <= tolerance)) [[unlikely]] {
      detail::throw_invalid("weights of a mixture do not sum to one, sum", sum);
    }
    for (Element& element : elements_) element.weight /= sum;
  }

  std::vector<Element> elements_;
};

/// Which pairs of components are fused: the plausibility alpha of MPG Eq. (19), here a function of the angle
/// between their tangent points. It keeps the linearisation valid; how well two components agree is part of
/// lambda, see FusionWeights.
enum class PlausibilityGate {
  kHard,     ///< 1 up to max_angle, then 0
  kTapered,  ///< 1 up to max_angle, then falling with cos^2 to 0 at 1.5 max_angle
};

/// How pairs of components are weighted against each other: lambda of MPG Eq. (19).
enum class FusionWeights {
  kExact,  ///< the mass of the product, so that the fused mixture is the normalised product
  kPaper,  ///< exp(-d^2/2) with the Mahalanobis distance d: a broad pair counts as much as a precise one
};

/// Which pairs of components a fusion of mixtures takes, and how it weights them.
template <std::floating_point Scalar>
struct MixtureFusionOptions {
  FusionOptions<Scalar> pair = {};                  ///< of each pair; max_angle is that of the gate
  PlausibilityGate gate = PlausibilityGate::kHard;  ///< which pairs are compatible
  FusionWeights weights = FusionWeights::kExact;    ///< of the pairs
  /// A pair whose squared Mahalanobis distance is at most this passes the gate at any angle: wide components
  /// whose tangent points are far apart may well agree. The distance is that of exponential coordinates, with
  /// each covariance at its own mode: on a common tangent space, half a turn is as little as 3.5 standard
  /// deviations instead of 5.5. With zero the angle alone decides.
  Scalar agreement = Scalar(0);
};

/// The normalised product of two mixtures.
template <class Component>
struct MixtureFusion {
  using Scalar = typename Component::Scalar;  ///< of weights and densities

  Mixture<Component> mixture;  ///< one component for each compatible pair
  /// log of the integral of the product of both mixtures without the rejected pairs. With
  /// FusionWeights::kPaper, log C of MPG Eq. (20).
  Scalar log_mass;
  Scalar rejected_weight;      ///< pi_1i pi_2j summed over the pairs that the gate rejects
  int rejected_pairs;          ///< number of pairs that the gate rejects
  Scalar linearization_bound;  ///< weighted root mean square of those of the components, see Fusion
};

namespace detail {

/// log alpha; -infinity rejects. Components without a tangent space are always plausible.
template <class Component, class Scalar>
[[nodiscard]] Scalar log_plausibility(const Component& a, const Component& b,
                                      const MixtureFusionOptions<Scalar>& options) {
  if constexpr (requires { tangent_angle(a, b); }) {
    using std::cos;
    using std::log;
    const Scalar angle = tangent_angle(a, b), limit = options.pair.max_angle;
    if (angle <= limit) return Scalar(0);
    if (options.gate == PlausibilityGate::kTapered && angle < Scalar(1.5) * limit) {
      return Scalar(2) * log(cos((angle - limit) / limit * std::numbers::pi_v<Scalar>));
    }
    return -std::numeric_limits<Scalar>::infinity();
  }
  return Scalar(0);
}

/// Whether two components that the angle rejects agree all the same.
template <class Component, class Scalar>
[[nodiscard]] bool agree_at_any_angle(const Component& a, const Component& b,
                                      const MixtureFusionOptions<Scalar>& options) {
  if constexpr (requires { disagreement_squared(a, b); }) {
    return options.agreement > Scalar(0) && disagreement_squared(a, b) <= options.agreement;
  }
  return false;
}

template <class Component, class Scalar>
[[nodiscard]] auto fuse_plausible(const Component& a, const Component& b,
                                  const FusionOptions<Scalar>& options) {
  if constexpr (requires { fuse_anyway(a, b, options.transport); }) {
    return fuse_anyway(a, b, options.transport);
  } else {
    return fuse(a, b);
  }
}

template <class T>
inline constexpr bool kIsMixture = false;
template <class Component>
inline constexpr bool kIsMixture<Mixture<Component>> = true;

}  // namespace detail

/// fuse(), but nothing if no pair of components is compatible: the gate rejects all, or the mass of their
/// products underflows (means 1e150 m apart).
template <class Component>
[[nodiscard]] std::optional<MixtureFusion<Component>> try_fuse(
    const Mixture<Component>& a, const Mixture<Component>& b,
    const MixtureFusionOptions<typename Component::Scalar>& options = {}) {
  using Scalar = typename Component::Scalar;
  using std::exp;
  using std::log;
  using std::sqrt;
  constexpr Scalar kInfinity = std::numeric_limits<Scalar>::infinity();
  std::vector<typename Mixture<Component>::Element> elements;  // weights are logarithms until normalised
  elements.reserve(a.size() * b.size());
  Scalar rejected_weight(0), largest = -kInfinity, squared_bounds(0);
  std::vector<Scalar> bounds;
  bounds.reserve(elements.capacity());
  int rejected_pairs = 0;
  for (const auto& [weight_a, density_a] : a) {
    for (const auto& [weight_b, density_b] : b) {
      Scalar log_alpha = detail::log_plausibility(density_a, density_b, options);
      if (log_alpha < Scalar(0) && detail::agree_at_any_angle(density_a, density_b, options)) {
        log_alpha = Scalar(0);
      }
      if (!(log_alpha > -kInfinity)) {
        rejected_weight += weight_a * weight_b;
        ++rejected_pairs;
        continue;
      }
      auto fused = detail::fuse_plausible(density_a, density_b, options.pair);
      const Scalar log_lambda = options.weights == FusionWeights::kExact
                                    ? fused.log_mass
                                    : Scalar(-0.5) * fused.mahalanobis_squared;
      const Scalar log_weight = log(weight_a) + log(weight_b) + log_alpha + log_lambda;
      if (!(log_weight > -kInfinity)) continue;
      largest = std::max(largest, log_weight);
      elements.push_back({log_weight, std::move(fused.density)});
      bounds.push_back(fused.linearization_bound);
    }
  }
  if (elements.empty()) return std::nullopt;
  Scalar sum(0);
  for (std::size_t k = 0; k < elements.size(); ++k) {
    elements[k].weight = exp(elements[k].weight - largest);
    sum += elements[k].weight;
    if (elements[k].weight > Scalar(0)) squared_bounds += elements[k].weight * bounds[k] * bounds[k];
  }
  return MixtureFusion<Component>{Mixture<Component>::normalized(std::move(elements)), largest + log(sum),
                                  rejected_weight, rejected_pairs, sqrt(squared_bounds / sum)};
}

/// The fusion of two independent estimates of one pose: all pairs of components fused, with the weights
/// pi_1i pi_2j alpha_ij lambda_ij normalised (MPG Eqs. 19-20). Throws if no pair is compatible (see
/// try_fuse).
template <class Component>
[[nodiscard]] MixtureFusion<Component> fuse(
    const Mixture<Component>& a, const Mixture<Component>& b,
    const MixtureFusionOptions<typename Component::Scalar>& options = {}) {
  auto fused = try_fuse(a, b, options);
  if (!fused) [[unlikely]] {
    detail::throw_invalid("incompatible mixtures: no pair of components has a product, pairs",
                          a.size() * b.size());
  }
  return *std::move(fused);
}

/// The density of a b for independent poses: all pairs of components composed (MPG Eqs. 21-22). Options are
/// those of the components' compose.
template <class Component, class... Options>
[[nodiscard]] Mixture<Component> compose(const Mixture<Component>& a, const Mixture<Component>& b,
                                         const Options&... options) {
  std::vector<typename Mixture<Component>::Element> elements;
  elements.reserve(a.size() * b.size());
  for (const auto& [weight_a, density_a] : a) {
    for (const auto& [weight_b, density_b] : b) {
      elements.push_back({weight_a * weight_b, compose(density_a, density_b, options...)});
    }
  }
  return Mixture<Component>::normalized(std::move(elements));
}

/// The density of x y, for a known pose y or a single component y.
template <class Component, class Other, class... Options>
requires(!detail::kIsMixture<Other>)
    [[nodiscard]] Mixture<Component> compose(const Mixture<Component>& x, const Other& y,
                                             const Options&... options) {
  std::vector<typename Mixture<Component>::Element> elements;
  elements.reserve(x.size());
  for (const auto& [weight, density] : x) elements.push_back({weight, compose(density, y, options...)});
  return Mixture<Component>::normalized(std::move(elements));
}

/// The density of y x, for a known pose y or a single component y.
template <class Component, class Other, class... Options>
requires(!detail::kIsMixture<Other>)
    [[nodiscard]] Mixture<Component> compose(const Other& y, const Mixture<Component>& x,
                                             const Options&... options) {
  std::vector<typename Mixture<Component>::Element> elements;
  elements.reserve(x.size());
  for (const auto& [weight, density] : x) elements.push_back({weight, compose(y, density, options...)});
  return Mixture<Component>::normalized(std::move(elements));
}

/// The density of x^-1.
template <class Component, class... Options>
[[nodiscard]] Mixture<Component> inverse(const Mixture<Component>& x, const Options&... options) {
  std::vector<typename Mixture<Component>::Element> elements;
  elements.reserve(x.size());
  for (const auto& [weight, density] : x) elements.push_back({weight, inverse(density, options...)});
  return Mixture<Component>::normalized(std::move(elements));
}

/// The density of a^-1 b for independent poses.
template <class Component, class... Options>
[[nodiscard]] Mixture<Component> relative_pose(const Mixture<Component>& a, const Mixture<Component>& b,
                                               const Options&... options) {
  return compose(inverse(a, options...), b, options...);
}

}  // namespace antipode
