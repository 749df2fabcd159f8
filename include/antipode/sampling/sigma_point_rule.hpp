// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <utility>

#include <antipode/eigen_types.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// The concept of a sigma point rule.
namespace antipode {

/// A deterministic way to replace a density by Rule::kCount weighted points.
///
/// Laws:
/// - the weights are non-negative and sum to one;
/// - the points have the mean and the covariance of the density, on a sphere its scatter matrix, up to
///   rounding;
/// - nothing is allocated;
/// - equal arguments give equal points, bit for bit.
template <class Rule, class D>
concept SigmaPointRule = requires(const Rule& rule, const D& density) {
  { Rule::kCount } -> std::convertible_to<int>;
  requires decltype(sample(rule, density))::kCount == Rule::kCount;
  { sample(rule, density).weights } -> std::convertible_to<Vector<typename D::Scalar, Rule::kCount>>;
};

/// A sigma point rule for pose densities: its points are the columns [q; p] of 8 x kCount.
template <class Rule, class D>
concept PoseRule = SigmaPointRule<Rule, D> &&
    (decltype(sample(std::declval<const Rule&>(), std::declval<const D&>()))::kDim == 8);

}  // namespace antipode
