// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <stdexcept>
#include <tuple>
#include <type_traits>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// A state on any manifold with its covariance.
namespace antipode {

namespace detail {

/// A point as its type makes it, its vectors zero: Eigen leaves in them what the memory held.
template <class Point>
[[nodiscard]] Point default_point() {
  Point point{};
  if constexpr (requires { point.setZero(); }) {
    point.setZero();
  } else if constexpr (requires { std::tuple_size<Point>::value; }) {
    std::apply([](auto&... parts) { ((parts = default_point<std::remove_cvref_t<decltype(parts)>>()), ...); },
               point);
  }
  return point;
}

}  // namespace detail

/// A concentrated density on any manifold: the state is Chart::retract(state, xi), xi ~ N(0, covariance). Of
/// a joint state, ProductChart<SplitChart<double>, VectorChart<double, 6>> say, `state` is a tuple, and the
/// blocks of the covariance are in the order of the charts.
template <Chart Chart_>
struct StateGaussian {
  using Chart = Chart_;                   ///< in which xi is normally distributed
  using Scalar = typename Chart::Scalar;  ///< of coordinates

  typename Chart::Point state = detail::default_point<typename Chart::Point>();  ///< the mean
  Matrix<Scalar, Chart::kDim> covariance = Matrix<Scalar, Chart::kDim>::Zero();  ///< of xi
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

/// Throws unless the density's covariance is finite and symmetric.
template <ConcentratedDensity Density>
void require_symmetric(const Density& density) {
  constexpr bool kPose =
      std::same_as<typename Density::Chart::Point, DualQuaternion<typename Density::Scalar>>;
  require_covariance<typename Density::Scalar, Density::Chart::kDim>(
      kPose ? "pose covariance is not finite or not symmetric"
            : "state covariance is not finite or not symmetric",
      density.covariance);
}

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

/// e^T P^-1 e with e = C::local(x.state, state), as that of a pose (pose_gaussian_queries.hpp): chi-square
/// with C::kDim degrees of freedom for draws of x. Throws std::domain_error if the covariance is singular,
/// std::invalid_argument if it is not symmetric or not finite.
template <Chart C>
[[nodiscard]] typename C::Scalar mahalanobis_squared(const StateGaussian<C>& x,
                                                     const typename C::Point& state) {
  using Scalar = typename C::Scalar;
  constexpr int N = C::kDim;
  const auto L = detail::cholesky_factor<Scalar, N>(
      detail::checked_covariance<Scalar, N>("state covariance is not finite or not symmetric", x.covariance));
  if (!L) [[unlikely]] {
    throw std::domain_error("a state density with a singular covariance has no Mahalanobis distance");
  }
  return detail::solve_lower<Scalar, N, 1>(*L, C::local(x.state, state)).squaredNorm();
}

/// The normalised estimation error squared (NEES) of an estimated joint state, given the true one:
/// mahalanobis_squared. It is C::kDim on average if the covariance is right.
template <Chart C>
[[nodiscard]] typename C::Scalar nees(const StateGaussian<C>& estimate, const typename C::Point& truth) {
  return mahalanobis_squared(estimate, truth);
}

}  // namespace antipode
