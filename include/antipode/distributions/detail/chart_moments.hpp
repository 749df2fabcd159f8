// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// Whether a step to the mean is short in every coordinate, each compared with its own standard deviation: a
/// position known to 300 m does not excuse a step of .3 rad. What is rounding beside the other coordinates of
/// the same unit is short, too: coordinates may have no variance. `second` are the moments about the point
/// that the step starts from.
template <class Scalar, int N>
[[nodiscard]] bool is_short_step(const Vector<Scalar, N>& step, const Matrix<Scalar, N>& second,
                                 Scalar tolerance) {
  constexpr Scalar kRounding = Scalar(16) * std::numeric_limits<Scalar>::epsilon();
  const Vector<Scalar, N> largest = largest_of_triples<Scalar, N>(second);
  bool is_short = true;
  for (int i = 0; i < static_cast<int>(step.size()); ++i) {
    const Scalar sigma = std::sqrt(std::max(second(i, i), Scalar(0)));
    is_short &= std::abs(step[i]) <= std::max(tolerance * sigma, kRounding * std::sqrt(largest[i]));
  }
  return is_short;
}

/// The mean of weighted points of a manifold, about which their weighted vectors sum to zero, and the
/// covariance of these vectors, by iteration from a point near the mean. To first order in the last step if
/// ten iterations do not settle, as for points spread over much of the rotations.
template <ConcentratedDensity Density, std::size_t Count>
[[nodiscard]] Density chart_moments(
    typename Density::Chart::Point center, const std::array<typename Density::Chart::Point, Count>& points,
    const Vector<typename Density::Scalar, static_cast<int>(Count)>& weights) {
  using Chart = typename Density::Chart;
  using Scalar = typename Density::Scalar;
  constexpr int N = Chart::kDim;
  constexpr int kMostIterations = 10;
  constexpr Scalar kSettled =
      Scalar(1e-3);  // step relative to the spread; the next one is of the order of its square
  Matrix<Scalar, N> covariance;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    Vector<Scalar, N> mean = Vector<Scalar, N>::Zero();
    covariance.setZero();
    for (std::size_t k = 0; k < Count; ++k) {
      const Vector<Scalar, N> xi = Chart::local(center, points[k]);
      const Scalar weight = weights[static_cast<int>(k)];
      mean += weight * xi;
      add_outer_product<Scalar, N, N>(weight, xi, xi, covariance);
    }
    const bool settled = is_short_step<Scalar, N>(mean, covariance, kSettled);
    add_outer_product<Scalar, N, N>(Scalar(-1), mean, mean, covariance);
    center = Chart::normalized(Chart::retract(center, mean));
    if (settled) break;
  }
  return {center, covariance};
}

}  // namespace antipode::detail
