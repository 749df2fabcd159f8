// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>

#include <antipode/distributions/gaussian_information.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/rectification_residual.hpp"
#include "stereo_slam/rig/stereo_measurement.hpp"

namespace stereo_slam {

/// Velocity of the rig when a frame was exposed.
struct RigVelocity {
  Vector6<double> per_s = Vector6<double>::Zero();  ///< rotation and translation, rad/s and m/s, camera axes
  double frame_s = 0.0;                             ///< usual time between two frames
  /// By how much it differs from that of the frame before: from there to half a frame ahead it is a guess.
  Vector6<double> change_per_s = Vector6<double>::Zero();
  Vector3<double> sigma_m_per_s = Vector3<double>::Zero();  ///< standard deviations of the translation

  /// T_left_later of a right image that is exposed `delay_s` later.
  [[nodiscard]] Pose motion_in(double delay_s) const { return Pose::exp(delay_s * per_s); }
};

/// By how much a measurement changes if the right image is taken to be later by a second.
struct DelayDerivative {
  double disparity_px_per_s = 0.0;
  double row_error_px_per_s = 0.0;
};

/// These derivatives in one frame, at a delay.
class DelayDerivatives {
 public:
  /// `geometry` is that of the frame without a delay.
  DelayDerivatives(const RectificationResidual& geometry, const RigVelocity& velocity, double delay_s);

  /// That of the measurement of a point.
  [[nodiscard]] DelayDerivative of(const StereoPoint& z) const;

 private:
  RectificationResidual before_, now_, after_;
};

/// The estimate of the time by which the right images are exposed later than the left ones. It begins with a
/// delay that is known from elsewhere; without one, right images are taken as simultaneous.
///
/// While the rig moves, a delay puts points in other rows of the right image than of the left one: by an
/// amount that depends on their depth, which no rotation of the right camera and no error of its
/// rectification does. What a rotation of the right camera in this frame could explain is left to it.
class ExposureDelay {
 public:
  /// Row coefficients have the standard deviation `row_sigma_px` before anything is known.
  explicit ExposureDelay(double row_sigma_px = 1.0) : row_sigma_px_(row_sigma_px) {}

  /// Begins with a delay. Throws std::invalid_argument unless it is finite and its standard deviation
  /// positive.
  void begin_with(const DelayEstimate& known);

  /// The delay in use: nothing without one.
  [[nodiscard]] const std::optional<DelayEstimate>& used() const noexcept { return used_; }

  /// Adds stereo matches of a frame, measured with `geometry` and the delay in use, in which the rig had this
  /// velocity. `geometry` is given without the delay. Does nothing if no delay is in use.
  void add(std::span<const StereoMeasurement> matches, const RectificationResidual& geometry,
           const RigVelocity& velocity, const StereoCamera& camera);

  /// Makes the best estimate so far the delay in use: by the rows and, once these tell it to a hundredth of a
  /// frame and both agree, by what all motions tell.
  void advance(const antipode::GaussianInformation<double, 1>& by_motions);

 private:
  static constexpr int kRows = RectificationResidual::kTerms;

  double row_sigma_px_;
  antipode::GaussianInformation<double, kRows + 1> rows_{};  // row coefficients in px, delay in s
  double frame_s_ = 0.0;  // the usual time between frames: 0 before the first frame
  std::optional<DelayEstimate> used_{};
};

}  // namespace stereo_slam
