// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <limits>
#include <utility>
#include <vector>

#include <antipode/filters/noisy_measurement.hpp>
#include <antipode/filters/robust_likelihood.hpp>
#include <antipode/filters/robust_noise.hpp>

/// @file
/// Measurements with Gaussian noise, as every update takes them.
namespace antipode {

/// Independent measurements z_i = h(x, i) + v_i, v_i ~ N(0, R_i), with their model h(pose, i), which returns
/// a vector or a std::optional of one. For a filter of joint states the model takes the state.
///
/// Every update takes them: as a log-likelihood (the call operator), or, if it linearises h, by the model and
/// the noise of each measurement. Constants are left out of the log-likelihood. A measurement that cannot be
/// predicted from a pose, of a landmark behind the camera say, counts as one at `unpredictable` standard
/// deviations; with the default such a pose is impossible. With Dim = Eigen::Dynamic the measurements may
/// have different lengths; R is then a MatrixXd.
template <std::floating_point Scalar, int Dim, class Model>
class GaussianMeasurements : public RobustMeasurements<Scalar, Dim, Model, NormalNoise<Scalar>> {
 public:
  /// Throws unless every z is finite and every R positive definite.
  GaussianMeasurements(std::vector<NoisyMeasurement<Scalar, Dim>> measurements, Model h,
                       Scalar unpredictable = std::numeric_limits<Scalar>::infinity())
      : RobustMeasurements<Scalar, Dim, Model, NormalNoise<Scalar>>(std::move(measurements), std::move(h), {},
                                                                    unpredictable) {}
};

/// The types follow from the arguments.
template <std::floating_point Scalar, int Dim, class Model>
GaussianMeasurements(std::vector<NoisyMeasurement<Scalar, Dim>>, Model)
    -> GaussianMeasurements<Scalar, Dim, Model>;
/// The types follow from the arguments.
template <std::floating_point Scalar, int Dim, class Model>
GaussianMeasurements(std::vector<NoisyMeasurement<Scalar, Dim>>, Model, Scalar)
    -> GaussianMeasurements<Scalar, Dim, Model>;

}  // namespace antipode
