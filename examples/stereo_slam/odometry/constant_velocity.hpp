// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/odometry/expected_motion.hpp"

namespace stereo_slam {

/// Time without a measured motion, in steps (intervals between frames).
struct UnseenSteps {
  double before = 0.0;  ///< up to the last frame
  double now = 1.0;     ///< from the last frame to the current one
};

/// Constant-velocity motion model.
///
/// A step is the time between the two frames of the last measured motion. Stamps that do not increase count
/// as one step. How constant the velocity is follows from the motions themselves: the standard deviations of
/// the expected motion are the largest changes of the last few steps, and after a surprise they are wide for
/// some frames, so that a wrong motion, such as that relative to a vehicle, is soon corrected.
class ConstantVelocity {
 public:
  /// After this time the velocity is no longer believed: the predicted motion is the identity.
  static constexpr double kLongest_steps = 50.0;

  /// Predicted T_last_current from the last frame to one with this stamp; the identity after kLongest_steps.
  [[nodiscard]] Pose motion_until(std::int64_t stamp_ns) const;

  /// The predicted motion with its standard deviations, which are proportional to the unseen steps. Nothing
  /// is known before a motion was measured.
  [[nodiscard]] ExpectedMotion expected_until(std::int64_t stamp_ns) const;

  /// Whether a motion was measured; before that the prediction is the identity.
  [[nodiscard]] bool known() const noexcept { return step_ns_ > 0.0; }

  /// The last measured motion (rotation, translation), rad and m, and the time it took, ns.
  [[nodiscard]] const Vector6<double>& per_step() const noexcept { return per_step_; }
  [[nodiscard]] double step_ns() const noexcept { return step_ns_; }
  /// Of the last frame.
  [[nodiscard]] std::int64_t stamp_ns() const noexcept { return stamp_ns_; }

  /// Unmeasured steps before and since the last frame. The latter are never less than one: a frame with an
  /// unknown motion adds uncertainty however soon it comes.
  [[nodiscard]] UnseenSteps unseen_until(std::int64_t stamp_ns) const;

  /// Adds a frame with its measured motion from the last frame.
  void measured(std::int64_t stamp_ns, const Pose& T_previous_current);

  /// Adds a frame without a measured motion.
  void unmeasured(std::int64_t stamp_ns);

  /// Adds a frame whose pose is known again, but not its motion.
  void found(std::int64_t stamp_ns);

 private:
  /// The largest change of the motion in the last steps.
  class Change {
   public:
    void add(double change);
    [[nodiscard]] double sigma(double least) const;

   private:
    double variance_ = 0.0;
  };

  [[nodiscard]] double steps_until(std::int64_t stamp_ns) const;

  Vector6<double> per_step_ = Vector6<double>::Zero();
  Change rotation_rad_, translation_m_;  // per step
  double step_ns_ = 0.0;                 // 0: no motion was measured yet
  std::int64_t stamp_ns_ = 0;
  double unseen_steps_ = 0.0;
};

}  // namespace stereo_slam
