// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <antipode/detail/cholesky.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/log_likelihood.hpp>
#include <antipode/filters/noisy_measurement.hpp>

/// @file
/// Measurements with Gaussian noise, as every update takes them.
namespace antipode {

/// Independent measurements z_i = h(x, i) + v_i, v_i ~ N(0, R_i), with their model h(pose, i), which returns
/// a vector or a std::optional of one. For a filter of joint states the model takes the state.
///
/// Every update takes them: as a log-likelihood (the call operator), or, if it linearises h, by the model and
/// the noise of each measurement. Constants are left out of the log-likelihood. A pose from which a
/// measurement cannot be predicted, a landmark behind the camera say, has the log-likelihood `unpredictable`.
/// With Dim = Eigen::Dynamic the measurements may have different lengths; R is then a MatrixXd.
template <std::floating_point Scalar, int Dim, class Model>
class GaussianMeasurements {
 public:
  using Measurement = NoisyMeasurement<Scalar, Dim>;  ///< z_i and R_i

  /// Throws unless every z is finite and every R positive definite.
  GaussianMeasurements(std::vector<Measurement> measurements, Model h,
                       Scalar unpredictable = -std::numeric_limits<Scalar>::infinity())
      : measurements_(std::move(measurements)),
        roots_(detail::roots_of_noise(measurements_)),
        h_(std::move(h)),
        unpredictable_(unpredictable) {}

  /// All z_i with their R_i.
  [[nodiscard]] const std::vector<Measurement>& measurements() const noexcept { return measurements_; }
  /// The model h.
  [[nodiscard]] const Model& model() const noexcept { return h_; }

  /// The log-likelihood of a pose or a joint state, without constants.
  template <class State>
  requires std::invocable<const Model&, const State&, std::size_t>
  [[nodiscard]] Scalar operator()(const State& state) const {
    Scalar sum(0);
    for (std::size_t i = 0; i < measurements_.size(); ++i) {
      const auto predicted = detail::checked_prediction(measurements_[i].z, h_(state, i));
      if (!predicted) return unpredictable_;
      const Vector<Scalar, Dim> innovation = measurements_[i].z - *predicted;
      sum -= Scalar(0.5) * detail::solve_lower<Scalar, Dim, 1>(roots_[i], innovation).squaredNorm();
    }
    return sum;
  }

 private:
  std::vector<Measurement> measurements_;
  std::vector<Matrix<Scalar, Dim>> roots_;  ///< Cholesky factors of the R_i
  Model h_;
  Scalar unpredictable_;
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
