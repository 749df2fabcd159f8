// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/detail/check.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>
#include <antipode/filters/noisy_measurement.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/update_status.hpp>

namespace antipode::detail {

/// What linearized_update() and gauss_newton_update() share: the prior, the density on its way to the
/// posterior, the measurements with their model, and the result.
template <class Density, class Measurements, class Model>
class MeasurementIteration {
 protected:
  using Scalar = typename Density::Scalar;
  static constexpr int N = Density::Chart::kDim;

  MeasurementIteration(const Density& prior, const Measurements& measurements, const Model& h)
      : origin_(SqrtGaussian<Density>::of(prior)),
        density_(origin_),
        measurements_(measurements),
        h_(h),
        result_{.posterior = prior} {}

  /// Whether there are measurements, and all with finite noise.
  [[nodiscard]] bool begins() {
    if (measurements_.size() == 0) return false;
    return has_finite_noise(measurements_) || fail(UpdateStatus::kNotFinite);
  }

  /// Ends the iteration; the posterior stays the prior.
  [[nodiscard]] bool fail(UpdateStatus status) {
    result_.status = status;
    return false;
  }

  const SqrtGaussian<Density> origin_;  ///< the prior
  SqrtGaussian<Density> density_;
  const Measurements& measurements_;
  const Model& h_;
  UpdateResult<Density> result_;
};

/// Throws unless the numbers that both updates have are positive.
template <class Options>
void check_iteration_options(const Options& options) {
  if (options.max_iterations < 1) [[unlikely]]
    throw_invalid("max_iterations is not positive", options.max_iterations);
  if (!(options.tolerance > 0)) [[unlikely]]
    throw_invalid("tolerance is not positive", options.tolerance);
  if (!(options.max_final_residual > 0)) [[unlikely]]
    throw_invalid("max_final_residual is not positive", options.max_final_residual);
}

}  // namespace antipode::detail
