// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <type_traits>

#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// A state on any manifold with its covariance.
namespace antipode {

/// A concentrated density on any manifold: the state is Chart::retract(state, xi), xi ~ N(0, covariance). Of
/// a joint state, ProductChart<SplitChart<double>, VectorChart<double, 6>> say, `state` is a tuple, and the
/// blocks of the covariance are in the order of the charts.
template <Chart Chart_>
struct StateGaussian {
  using Chart = Chart_;                   ///< in which xi is normally distributed
  using Scalar = typename Chart::Scalar;  ///< of coordinates

  typename Chart::Point state;             ///< the mean
  Matrix<Scalar, Chart::kDim> covariance;  ///< of xi
};

/// PoseGaussian in any chart and StateGaussian: {mean, covariance of the vector about it}.
template <class Density>
concept ConcentratedDensity = Chart<typename Density::Chart> &&
    requires(const typename Density::Chart::Point& mean,
             const Matrix<typename Density::Scalar, Density::Chart::kDim>& covariance) {
  Density{mean, covariance};
  requires std::same_as<decltype(Density::covariance), std::remove_cvref_t<decltype(covariance)>>;
};

namespace detail {

/// A root of the density's covariance. Throws unless that is finite and positive semidefinite.
template <ConcentratedDensity Density>
[[nodiscard]] auto root_of(const Density& density) {
  using Scalar = typename Density::Scalar;
  constexpr int N = Density::Chart::kDim;
  constexpr bool kPose = std::same_as<typename Density::Chart::Point, DualQuaternion<Scalar>>;
  return root_of_covariance<Scalar, N>(
      kPose ? "pose covariance has a negative eigenvalue" : "state covariance has a negative eigenvalue",
      checked_covariance<Scalar, N>(kPose ? "pose covariance is not finite or not symmetric"
                                          : "state covariance is not finite or not symmetric",
                                    density.covariance));
}

}  // namespace detail

}  // namespace antipode
