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
/// that the step starts from, `rounding` the known rounding errors of the coordinates.
template <class Scalar, int N>
[[nodiscard]] bool is_short_step(const Vector<Scalar, N>& step, const Matrix<Scalar, N>& second,
                                 Scalar tolerance,
                                 const Vector<Scalar, N>& rounding = Vector<Scalar, N>::Zero()) {
  constexpr Scalar kRounding = Scalar(16) * std::numeric_limits<Scalar>::epsilon();
  const Vector<Scalar, N> largest = largest_of_triples<Scalar, N>(second);
  bool is_short = true;
  for (int i = 0; i < static_cast<int>(step.size()); ++i) {
    const Scalar sigma = std::sqrt(std::max(second(i, i), Scalar(0)));
    is_short &=
        std::abs(step[i]) <= std::max({tolerance * sigma, kRounding * std::sqrt(largest[i]), rounding[i]});
  }
  return is_short;
}

/// The mean and the second moments of the vectors from a center to weighted points, point_of(0) to
/// point_of(count - 1). The weights sum to one.
template <Chart C>
struct MomentsAbout {
  using Scalar = typename C::Scalar;

  Vector<Scalar, C::kDim> mean = Vector<Scalar, C::kDim>::Zero();
  Matrix<Scalar, C::kDim> second = Matrix<Scalar, C::kDim>::Zero();

  template <class PointOf, class Weights>
  MomentsAbout(const typename C::Point& center, int count, const PointOf& point_of, const Weights& weights) {
    for (int k = 0; k < count; ++k) {
      const Vector<Scalar, C::kDim> xi = C::local(center, point_of(k));
      mean += weights[k] * xi;
      add_outer_product<Scalar, C::kDim, C::kDim>(weights[k], xi, xi, second);
    }
  }

  [[nodiscard]] Matrix<Scalar, C::kDim> covariance() const {
    Matrix<Scalar, C::kDim> centered = second;
    add_outer_product<Scalar, C::kDim, C::kDim>(Scalar(-1), mean, mean, centered);
    return centered;
  }
};

/// The mean of weighted points of a manifold, about which their weighted vectors sum to zero, and the
/// covariance of these vectors, by iteration from a point near the mean. To first order in the last step if
/// ten iterations do not settle, as for points spread over much of the rotations.
template <ConcentratedDensity Density, std::size_t Count>
[[nodiscard]] Density chart_moments(
    typename Density::Chart::Point center, const std::array<typename Density::Chart::Point, Count>& points,
    const Vector<typename Density::Scalar, static_cast<int>(Count)>& weights) {
  using Chart = typename Density::Chart;
  using Scalar = typename Density::Scalar;
  constexpr int kMostIterations = 10;
  constexpr Scalar kSettled =
      Scalar(1e-3);  // step relative to the spread; the next one is of the order of its square
  Matrix<Scalar, Chart::kDim> covariance;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const MomentsAbout<Chart> moments(
        center,
        static_cast<int>(Count), [&](int k) -> const auto& { return points[static_cast<std::size_t>(k)]; },
        weights);
    covariance = moments.covariance();
    center = Chart::normalized(Chart::retract(center, moments.mean));
    if (is_short_step<Scalar, Chart::kDim>(moments.mean, moments.second, kSettled)) break;
  }
  return {center, covariance};
}

}  // namespace antipode::detail
