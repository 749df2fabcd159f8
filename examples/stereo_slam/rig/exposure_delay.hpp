// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>

#include <antipode/distributions/gaussian_information.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/pair_geometry.hpp"
#include "stereo_slam/rig/stereo_measurement.hpp"

namespace stereo_slam {

/// Mean velocity of the rig from one frame to the next.
struct RigVelocity {
  Vector6<double> per_s = Vector6<double>::Zero();  ///< rotation and translation, rad/s and m/s, camera axes
  double frame_s = 0.0;                             ///< time between the two frames
};

/// The motion of the rig between the exposures of the two images of a frame. Its rotation is measured in
/// every frame, so that it does not depend on the delay; its translation is that of a velocity.
struct LateMotion {
  Vector3<double> turn_rad = Vector3<double>::Zero();        ///< as the velocity predicts it
  Vector3<double> turn_left_rad = Vector3<double>::Zero();   ///< what the images showed besides
  Vector3<double> m_per_s = Vector3<double>::Zero();         ///< camera axes
  Vector3<double> sigma_turn_rad = Vector3<double>::Zero();  ///< standard deviations
  Vector3<double> sigma_m_per_s = Vector3<double>::Zero();   ///< likewise

  /// T_left_later of a right image that is exposed `delay_s` later.
  [[nodiscard]] Pose in(double delay_s) const {
    Vector6<double> motion;
    motion << turn_rad + turn_left_rad, delay_s * m_per_s;
    return Pose::exp(motion);
  }
};

/// The estimate of the time by which the right images are exposed later than the left ones. It begins with a
/// delay that is known from elsewhere; without one, right images are taken as simultaneous.
///
/// While the rig moves, a delay puts points in other rows of the right image than of the left one: by an
/// amount that depends on their depth, which no rotation of the right camera and no error of its
/// rectification does. What a rotation of the rig until the exposure could explain is left to it, and so is
/// the error of its translation.
class ExposureDelay {
 public:
  /// Row coefficients have the standard deviation `row_sigma_px` before anything is known.
  explicit ExposureDelay(double row_sigma_px = 1.0) : row_sigma_px_(row_sigma_px) {}

  /// Begins with a delay. Throws std::invalid_argument unless it is finite and its standard deviation
  /// positive.
  void begin_with(const DelayEstimate& known);

  /// The delay in use: nothing without one.
  [[nodiscard]] const std::optional<DelayEstimate>& used() const noexcept { return used_; }

  /// Adds stereo matches of a frame, measured with `geometry` and the delay in use, in which the rig moved
  /// so. `geometry` is given without the delay. Does nothing if no delay is in use.
  void add(std::span<const StereoMeasurement> matches, const PairGeometry& geometry, const LateMotion& motion,
           const StereoCamera& camera);

  /// Makes the best estimate so far the delay in use.
  void advance();

 private:
  static constexpr int kRows = PairGeometry::kTerms;

  double row_sigma_px_;
  antipode::GaussianInformation<double, kRows + 1> rows_{};  // row coefficients in px, delay in s
  std::optional<DelayEstimate> used_{};
};

}  // namespace stereo_slam
