// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <utility>

/// @file
/// Concepts of a manifold and of a Lie group, for the checks in antipode/testing.
namespace antipode {

/// Tangent vectors of a manifold: the type of the difference of two of its points.
template <class M>
using Tangent = decltype(std::declval<const M&>().boxminus(std::declval<const M&>()));

/// A smooth space whose points differ by vectors of fixed length.
///
/// Laws, for points x, y and small vectors a (inside the injectivity radius):
/// - x.boxplus(0) = x;
/// - x.boxplus(y.boxminus(x)) = y;
/// - x.boxplus(a).boxminus(x) = a;
/// - boxplus is smooth in both arguments.
///
/// "=" means: equal as points, not as numbers (q and -q are one rotation).
template <class M>
concept Manifold = std::copyable<M> && requires(const M& x, const M& y, const Tangent<M>& a) {
  typename M::Scalar;
  { x.boxplus(a) } -> std::convertible_to<M>;
  { x.boxminus(y) } -> std::same_as<Tangent<M>>;
  requires Tangent<M>::RowsAtCompileTime >
  0;
};

/// A manifold that is a group, perturbed on the right.
///
/// Laws:
/// - (x y) z = x (y z);
/// - x identity() = identity() x = x;
/// - x x.inverse() = identity();
/// - exp(log(x)) = x, and log(exp(a)) = a inside the injectivity radius;
/// - x.boxplus(a) = x exp(a);
/// - x exp(a) x.inverse() = exp(x.adjoint() a).
template <class G>
concept LieGroup = Manifold<G> && requires(const G& x, const G& y, const Tangent<G>& a) {
  { G::identity() } -> std::convertible_to<G>;
  { x* y } -> std::convertible_to<G>;
  { x.inverse() } -> std::convertible_to<G>;
  { G::exp(a) } -> std::convertible_to<G>;
  { x.log() } -> std::convertible_to<Tangent<G>>;
  { x.adjoint() * a } -> std::convertible_to<Tangent<G>>;
};

}  // namespace antipode
