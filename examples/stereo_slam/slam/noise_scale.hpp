// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Variance of an updated pose relative to the variance that follows from the assumed noise of the pixels,
/// for the components that depend on positions along and across the rows of the image. If all matches have
/// the same weight, it is the variance of unit weight of least squares. It is the mean over about the last
/// hundred updates, or more for a frame that is worse than these.
class NoiseScale {
 public:
  /// `expected` is the ratio of updates whose noise is as assumed.
  explicit NoiseScale(double expected = 1.0)
      : expected_(expected), mean_(Vector2<double>::Constant(expected)) {}

  /// Adds the variance ratios (u, v) of an update; nothing changes if they are not finite.
  void add(const Vector2<double>& variance_ratio) {
    if (!variance_ratio.allFinite()) return;
    updates_ = std::min(updates_ + 1, kWindow);
    mean_ += (variance_ratio - mean_) / updates_;
  }

  /// The mean; what is expected before the first update, never below kLeast of it.
  [[nodiscard]] Vector2<double> variance_ratio() const { return mean_.cwiseMax(kLeast * expected_); }

  /// The variance ratios of a frame whose update had the ratios `own`: the mean, and kExcess times what `own`
  /// exceeds the usual noise by. The cause of such an excess, motion blur for example, moves neighbouring
  /// landmarks alike, so that their errors do not average out; and the largest residuals are beyond the
  /// robust cap, and not in `own`.
  [[nodiscard]] Vector2<double> variance_ratio_of_frame(const Vector2<double>& own) const {
    if (!own.allFinite()) return variance_ratio();
    const Vector2<double> usual = kUsual * mean_.cwiseMax(expected_);
    return variance_ratio() + kExcess * (own - usual).cwiseMax(0.0);
  }

  /// An estimate of the filter, which counts in units of the assumed noise, with the covariance by the noise
  /// that was seen.
  [[nodiscard]] PoseGaussian as_seen(const PoseGaussian& assumed) const {
    return {assumed.pose, scaled(assumed.covariance, variance_ratio())};
  }
  /// The inverse: an estimate that has the right covariance, in the units of the filter.
  [[nodiscard]] PoseGaussian in_assumed_units(const PoseGaussian& seen) const {
    return {seen.pose, scaled(seen.covariance, variance_ratio().cwiseInverse())};
  }

  /// The covariance of a pose with variance ratios of the noise. Rotations about x and z and the translation
  /// along y move points across the rows and have the noise in v; the other components have the noise in u.
  /// For the rotation about z and the translation along z this holds in images that are much wider than high.
  [[nodiscard]] static Matrix6<double> scaled(const Matrix6<double>& covariance,
                                              const Vector2<double>& variance_ratio) {
    const Vector2<double> factor = variance_ratio.cwiseSqrt();
    const double u = factor.x();
    const double v = factor.y();
    const Vector6<double> factors{{v, u, v, u, v, u}};
    return covariance.cwiseProduct(factors * factors.transpose());
  }

 private:
  static constexpr double kLeast = 0.2;  // images without noise still have errors of interpolation
  static constexpr double kUsual = 1.3;  // of the mean, or of the assumed noise: within chance
  static constexpr double kExcess = 5.0;
  static constexpr int kWindow = 100;
  static constexpr int kPriorUpdates = 5;  // the first updates do not decide alone

  double expected_;
  Vector2<double> mean_;
  int updates_ = kPriorUpdates;
};

}  // namespace stereo_slam
