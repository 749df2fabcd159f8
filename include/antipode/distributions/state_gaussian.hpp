// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>

namespace antipode {

/// A concentrated density on any manifold: the state is Chart::retract(state, xi), xi ~ N(0, covariance). Of
/// a joint state, ProductChart<SplitChart<double>, VectorChart<double, 6>> say, `state` is a tuple, and the
/// blocks of the covariance are in the order of the charts.
template <Chart Chart_>
struct StateGaussian {
  using Chart = Chart_;
  using Scalar = typename Chart::Scalar;

  typename Chart::Point state;
  Matrix<Scalar, Chart::kDim> covariance;
};

/// PoseGaussian in any chart and StateGaussian: {mean, covariance of the vector about it}.
template <class Density>
concept ConcentratedDensity = Chart<typename Density::Chart> &&
    requires(const typename Density::Chart::Point& mean,
             const Matrix<typename Density::Scalar, Density::Chart::kDim>& covariance) {
  Density{mean, covariance};
  requires std::same_as<decltype(Density::covariance), std::remove_cvref_t<decltype(covariance)>>;
};

}  // namespace antipode
