// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/inertial/inertial_filter.hpp"
#include "stereo_slam/odometry/constant_velocity.hpp"
#include "stereo_slam/odometry/expected_motion.hpp"
#include "stereo_slam/rig/exposure_delay.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/slam/tracked_pose.hpp"

namespace stereo_slam {

/// Frames without a measured motion.
enum class Gap {
  kStart,  ///< at most ten since the map began; the motion after them tells what it was before
  kShort,  ///< at most ten after a measured motion: the covariance of a prediction over them holds
  kLong,   ///< more: a prediction over them is a guess
};

/// The motion that is expected of the next frame, and how far it is believed: that of an IMU if one is used,
/// otherwise one of constant velocity.
class MotionModel {
 public:
  /// Velocity, gravity and biases, if there is an IMU. It takes the readings that come with a frame before
  /// anything else is asked of the frame.
  [[nodiscard]] InertialFilter& inertial() noexcept { return inertial_; }
  [[nodiscard]] const InertialFilter& inertial() const noexcept { return inertial_; }

  /// The motion from the last frame to one with this stamp.
  [[nodiscard]] ExpectedMotion expected_until(std::int64_t stamp_ns) const;

  /// That motion with the covariance of its noise, for a frame in which none was measured.
  [[nodiscard]] PoseGaussian guessed_until(std::int64_t stamp_ns, const MotionSettings& settings) const;

  /// The velocity by the last measured motion; nothing before there is one.
  [[nodiscard]] std::optional<RigVelocity> velocity() const;
  /// The velocity if this is the motion from the last frame to one with this stamp; nothing if that is not
  /// later.
  [[nodiscard]] std::optional<RigVelocity> velocity_by(const Pose& T_last_current,
                                                       std::int64_t stamp_ns) const;

  /// The motion from the first keyframe to the last frame, if the motion since then, `T_last_current`, is the
  /// first that was measured: as if it had been the same before.
  [[nodiscard]] PoseGaussian motion_before_first(const Pose& T_last_current, std::int64_t stamp_ns,
                                                 const MotionSettings& settings) const;

  /// Time without a measured motion, see ConstantVelocity.
  [[nodiscard]] UnseenSteps unseen_until(std::int64_t stamp_ns) const {
    return velocity_.unseen_until(stamp_ns);
  }

  /// What is known of the motion over the frames since the last measured one.
  [[nodiscard]] Gap gap_until(std::int64_t stamp_ns) const {
    constexpr double kFew_steps = 11.0;  // ten frames between two that are measured
    const UnseenSteps unseen = unseen_until(stamp_ns);
    if (unseen.before + unseen.now > kFew_steps) return Gap::kLong;
    return known() ? Gap::kShort : Gap::kStart;
  }

  /// Whether a motion was measured.
  [[nodiscard]] bool known() const noexcept { return velocity_.known(); }

  /// Learns from a tracked frame. `T_keyframe_camera` is its posterior with the covariance by the noise that
  /// was seen, `T_keyframe_previous` that of the frame before, which was lost if `after_loss`.
  void learn(const TrackedPose& tracked, const PoseGaussian& T_keyframe_camera,
             const Pose& T_keyframe_previous, bool after_loss, std::int64_t stamp_ns);

  /// Whether the motion may be that of a vehicle in view: it began as a surprise that other points
  /// contradicted, and in no frame since then most points moved as it says. A camera that is shaken moves all
  /// static points alike.
  [[nodiscard]] bool in_doubt() const noexcept { return in_doubt_; }

  /// Begins with the first keyframe.
  void begin_map(std::int64_t stamp_ns);

 private:
  void learn_inertially(const TrackedPose& tracked, const PoseGaussian& T_keyframe_camera,
                        const Pose& T_keyframe_previous, bool after_loss, std::int64_t stamp_ns);

  ConstantVelocity velocity_;
  InertialFilter inertial_;
  bool in_doubt_ = false;
};

}  // namespace stereo_slam
