// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

/// @file
/// The concept of a density.
namespace antipode {

/// A probability density over points of type Point, known by its logarithm.
///
/// Laws:
/// - exp(log_density) integrates to one over the whole space, with respect to the measure the class
/// documents;
/// - two points that represent the same rotation (q and -q) have the same density, bit for bit.
template <class D, class Point>
concept Density = requires(const D& density, const Point& x) {
  typename D::Scalar;
  { density.log_density(x) } -> std::convertible_to<typename D::Scalar>;
};

}  // namespace antipode
