// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

namespace stereo_slam {

/// Variance of the measurement noise relative to the variance that the filter assumes: the mean normalised
/// innovation squared (NIS) per degree of freedom over about the last hundred updates. Least squares calls it
/// the variance of unit weight.
class NoiseScale {
 public:
  /// Adds the NIS of an update; nothing changes without degrees of freedom or for NaN.
  void add(double nis, int degrees_of_freedom) {
    if (degrees_of_freedom <= 0 || !std::isfinite(nis)) return;
    updates_ = std::min(updates_ + 1, kWindow);
    mean_ += (nis / degrees_of_freedom - mean_) / updates_;
  }

  /// 1 before the first update; never below kLeast.
  [[nodiscard]] double variance_ratio() const { return std::max(mean_, kLeast); }

 private:
  static constexpr double kLeast = 0.2;  // images without noise still have errors of interpolation
  static constexpr int kWindow = 100;
  static constexpr int kPriorUpdates = 5;  // the first updates do not decide alone

  double mean_ = 1.0;
  int updates_ = kPriorUpdates;
};

}  // namespace stereo_slam
