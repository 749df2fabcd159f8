// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

#include <antipode/detail/products.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// The mean of weighted points of a manifold, about which their weighted vectors sum to zero, and the
/// covariance of these vectors. To first order in the last step if ten iterations do not settle, as for
/// points spread over much of the rotations.
template <ConcentratedDensity Density, std::size_t Count>
[[nodiscard]] Density chart_moments(
    const std::array<typename Density::Chart::Point, Count>& points,
    const Vector<typename Density::Scalar, static_cast<int>(Count)>& weights) {
  using Chart = typename Density::Chart;
  using Scalar = typename Density::Scalar;
  constexpr int N = Chart::kDim;
  constexpr int kMostIterations = 10;
  constexpr Scalar kSettled =
      Scalar(1e-3);  // step relative to the spread; the next one is of the order of its square
  typename Chart::Point center = points[0];
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
    const bool settled = mean.squaredNorm() <= kSettled * kSettled * covariance.trace();
    add_outer_product<Scalar, N, N>(Scalar(-1), mean, mean, covariance);
    center = Chart::normalized(Chart::retract(center, mean));
    if (settled) break;
  }
  return {center, covariance};
}

}  // namespace antipode::detail
