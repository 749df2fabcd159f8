// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/noisy_measurement.hpp>
#include <antipode/filters/robust_noise.hpp>

/// @file
/// Likelihoods for measurements with outliers: wrong matches, moving objects, multipath.
///
/// A robust likelihood is a density of the noise with heavier tails than the Gaussian, given by its logarithm
/// as a function of the squared Mahalanobis distance of a measurement. Unlike weights (M-estimators, iterated
/// least squares) it is part of the model: quadratic_update and progressive_update find the posterior under
/// this likelihood, with its covariance.
///
/// This needs several measurements. A single one that fixes the whole pose, under a prior three or more times
/// as wide as its noise, leaves a posterior with heavy tails. With StudentT the standard deviations of
/// quadratic_update are then three quarters of the true ones or less, and the status is kNotGaussian. With
/// Contamination they are those of the peak: a measurement that is an outlier after all stays unnoticed, and
/// under a prior ten times as wide they are two thirds of the true ones.
namespace antipode {

/// Independent measurements z_i = h(x, i) + v_i with the scale matrices R_i, noise of the given kind, and
/// their model h(pose, i), which returns a vector or a std::optional of one. The counterpart of
/// GaussianMeasurements for data with outliers.
///
/// It is a log-likelihood, for quadratic_update (poses, and joint states of up to 18 dimensions),
/// progressive_update and the filters that use them. A measurement that cannot be predicted, a landmark
/// behind the camera say, counts as an outlier at `unpredictable` standard deviations. One whose squared
/// distance overflows, a sentinel of 1e300 say, counts as an outlier at the largest distance, so that it does
/// not disable the others. In many dimensions the points of the fits lie far out, where outliers and others
/// look alike, and the status is kNotGaussian: in 9 dimensions all of 150 updates with 20 % outliers
/// converge, in 18 dimensions under priors of .1 rad 6 of 150.
template <std::floating_point Scalar, int Dim, class Model, RobustNoise<Scalar> Noise>
class RobustMeasurements {
 public:
  using Measurement = NoisyMeasurement<Scalar, Dim>;  ///< z_i and R_i

  /// Throws unless every z is finite, every R positive definite and the noise valid.
  RobustMeasurements(std::vector<Measurement> measurements, Model h, Noise noise,
                     Scalar unpredictable = Scalar(1e3))
      : measurements_(std::move(measurements)),
        roots_(detail::roots_of_noise(measurements_)),
        h_(std::move(h)),
        noise_(noise),
        unpredictable_(unpredictable * unpredictable) {
    noise_.check();
  }

  /// All z_i with their R_i.
  [[nodiscard]] const std::vector<Measurement>& measurements() const noexcept { return measurements_; }
  /// The model h.
  [[nodiscard]] const Model& model() const noexcept { return h_; }
  /// The kind of noise, with its parameters.
  [[nodiscard]] const Noise& noise() const noexcept { return noise_; }

  /// The log-likelihood of a pose or a joint state, without constants.
  template <class State>
  requires std::invocable<const Model&, const State&, std::size_t>
  [[nodiscard]] Scalar operator()(const State& state) const {
    Scalar sum(0);
    for (std::size_t i = 0; i < measurements_.size(); ++i) {
      const auto predicted = detail::checked_prediction(measurements_[i].z, h_(state, i));
      const Scalar squared = predicted ? squared_distance(i, *predicted) : unpredictable_;
      sum += noise_.log_density(squared, static_cast<int>(measurements_[i].z.size()));
    }
    return sum;
  }

 private:
  /// The squared Mahalanobis distance of measurement i from a prediction; the largest number if it overflows,
  /// NaN only if the prediction is.
  [[nodiscard]] Scalar squared_distance(std::size_t i, const Vector<Scalar, Dim>& predicted) const {
    const Vector<Scalar, Dim> innovation = measurements_[i].z - predicted;
    const Scalar squared = detail::solve_lower<Scalar, Dim, 1>(roots_[i], innovation).squaredNorm();
    if (std::isfinite(squared) || predicted.hasNaN()) return squared;
    return std::numeric_limits<Scalar>::max();
  }

  std::vector<Measurement> measurements_;
  std::vector<Matrix<Scalar, Dim>> roots_;  ///< Cholesky factors of the R_i
  Model h_;
  Noise noise_;
  Scalar unpredictable_;  ///< squared distance
};

/// The types follow from the arguments.
template <std::floating_point Scalar, int Dim, class Model, class Noise>
RobustMeasurements(std::vector<NoisyMeasurement<Scalar, Dim>>, Model, Noise)
    -> RobustMeasurements<Scalar, Dim, Model, Noise>;

}  // namespace antipode
