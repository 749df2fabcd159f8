// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include <antipode/filters/robust_noise.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

// Where the variances of pixels come from: what is assumed of each kind of measurement, factors for errors
// that measurements have in common, and, in NoiseScale, what the residuals then show. Brackets name the page
// of docs/results/history that measured a number; one without a source is chosen.

// Standard deviations of a position in an image, px. The covariance of an aligned patch comes from its own
// residuals and texture besides; these are added, or are the least.

inline constexpr double kPatchSigma_px = 0.05;          ///< aligned patch of a landmark [2026-11-24-patches]
inline constexpr double kLandmarkSigma_px = 0.075;      ///< a landmark in its keyframe [2026-11-24-patches]
inline constexpr double kOdometrySigma_px = 0.4;        ///< point of the odometry [2026-11-24-patches]
inline constexpr double kLeastTrackedSigma_px = 0.025;  ///< least of a tracked point: half of that of a patch
inline constexpr double kFlowSigma_px = 0.5;            ///< corner followed by optical flow over some frames
/// Least of a patch that is aligned with an image some frames before.
inline constexpr double kOldPatchSigma_px = 0.1;
inline constexpr double kCornerSigma_px = 1.0;         ///< detected corner
inline constexpr double kGateSigma_px = 1.0;           ///< aligned patch, for the innovation gate
inline constexpr double kUnknownDisparity_px = 100.0;  ///< disparity that is not measured

// Standard deviations of what the errors of the rig are estimated from, px.

inline constexpr double kKeyframeDisparitySigma_px = 0.06;  ///< disparity measured in a keyframe
/// Row difference of a stereo match, with what neighbours have in common; and without, within one frame.
inline constexpr double kRowSigma_px = 0.3, kRowInFrameSigma_px = 0.15;

// Errors that measurements have in common, so that more of them do not average them out.

/// Points of a frame in the odometry, px: root mean square of the angles times the focal length
/// [2026-11-29-one-estimator].
inline constexpr double kSharedInFrame_px = 0.02;
/// All motions, px, with landmarks by the default and by the preset fast, where patches change more in the
/// longer life of a keyframe [2026-11-28-common-error-in-pixels].
inline constexpr double kCommonError_px = 0.008, kCommonErrorFast_px = 0.011;
/// Weight of what a motion tells of the errors of the cameras: those of neighbouring keyframes are alike
/// [2026-11-29-lens-error].
inline constexpr double kEvidenceWeight = 0.25;
/// Factor on the variance of a landmark that tells errors of the rig: wrong slopes of patches would pass for
/// such an error.
inline constexpr double kRigCaution = 8.0;
/// Factor on the covariance of a loop: its points have errors in common (docs/results/loops.md).
inline constexpr double kLoopCovarianceScale = 2.0;
/// Factor on the covariance of the rough pose by a recognised keyframe. The pose comes from points that the
/// update uses again: it says where to look, and must hardly count as information.
inline constexpr double kRecognisedScale = 9.0;

/// The loss of measurements of points, some of which are wrong matches or on moving objects: a weight halves
/// at the squared Mahalanobis distance 6, which one in nine good measurements of (u, v, disparity) exceeds.
inline constexpr antipode::CauchyLoss<double> kOutlierLoss{2.449489742783178};

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
  static constexpr double kLeast = 0.2;    // the cleanest rendered drives have .15: errors of interpolation
  static constexpr double kUsual = 1.3;    // of the mean, or of the assumed noise: within chance
  static constexpr double kExcess = 5.0;   // measured on a rendered flight [2026-11-27-drone]
  static constexpr int kWindow = 100;      // updates
  static constexpr int kPriorUpdates = 5;  // the first updates do not decide alone

  double expected_;
  Vector2<double> mean_;
  int updates_ = kPriorUpdates;
};

}  // namespace stereo_slam
