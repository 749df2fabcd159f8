// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// By how much three numbers, measured again and again, vary more than their noise explains: the variance of
/// a random effect, by restricted maximum likelihood. Their common mean is unknown, so that one measurement
/// tells nothing.
class ExcessVariance {
 public:
  /// Adds a measurement and the variances of its noise, which must be positive.
  void add(const Vector3<double>& value, const Vector3<double>& noise_variance) {
    constexpr std::size_t kWindow = 30;  // measurements: the variance is known to a quarter
    constexpr int kRounds = 5;           // each leaves at most half of the error
    measurements_.push_back({value, noise_variance});
    if (measurements_.size() > kWindow) measurements_.erase(measurements_.begin());
    for (int round = 0; round < kRounds; ++round) improve();
  }

  /// Zero before the second measurement. In the squared unit of the numbers.
  [[nodiscard]] const Vector3<double>& value() const noexcept { return variance_; }

 private:
  struct Measurement {
    Vector3<double> value, noise_variance;
  };

  /// A step of the fixed-point iteration for the likelihood's derivative to be zero.
  void improve() {
    const Vector3<double> zero = Vector3<double>::Zero();
    Vector3<double> mean = zero, weights = zero, squared_weights = zero, excess = zero;
    for (const auto& m : measurements_) {
      const Vector3<double> weight = (variance_ + m.noise_variance).cwiseInverse();
      weights += weight;
      mean += weight.cwiseProduct(m.value);
    }
    mean = mean.cwiseQuotient(weights);
    for (const auto& m : measurements_) {
      const Vector3<double> weight2 = (variance_ + m.noise_variance).cwiseInverse().cwiseAbs2();
      squared_weights += weight2;
      excess += weight2.cwiseProduct((m.value - mean).cwiseAbs2() - m.noise_variance);
    }
    variance_ = (excess.cwiseQuotient(squared_weights) + weights.cwiseInverse()).cwiseMax(0.0);
  }

  std::vector<Measurement> measurements_;  // the last ones
  Vector3<double> variance_ = Vector3<double>::Zero();
};

}  // namespace stereo_slam
