// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// A pose with its 6 x 6 covariance.
namespace antipode {

/// A concentrated pose density: the pose is mean * exp(xi), xi = (phi, rho) ~ N(0, covariance), rotation
/// first; in another chart (geometry/chart.hpp), Chart::retract(mean, xi).
///
/// Plain data, for filters that work on the tangent space; BinghamGaussian is the density of SE(3) itself,
/// valid for wide orientations too. to_pose_gaussian() and to_bingham_gaussian() convert between the two, to
/// first order in the rotation's covariance; in_chart() (pose_charts.hpp) changes the chart.
template <std::floating_point Scalar_, class Chart_ = ScrewChart<Scalar_>>
requires std::same_as<typename Chart_::Point, DualQuaternion<Scalar_>>
struct PoseGaussian {
  using Scalar = Scalar_;  ///< of coordinates and densities
  using Chart = Chart_;    ///< in which xi is normally distributed

  DualQuaternion<Scalar> pose = DualQuaternion<Scalar>::identity();  ///< the mean
  Matrix6<Scalar> covariance = Matrix6<Scalar>::Zero();              ///< of xi: rad^2, rad m, m^2
};

/// A concentrated pose density with rotation and position apart: phi in the axes of the body, the error of
/// the position in the axes of the parent. For measured positions (altimeter, GPS, ranges) while the attitude
/// is known to degrees.
template <std::floating_point Scalar>
using SplitPoseGaussian = PoseGaussian<Scalar, SplitChart<Scalar>>;

}  // namespace antipode
