// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/odometry/constant_velocity.hpp"
#include "stereo_slam/odometry/jerk_monitor.hpp"
#include "stereo_slam/odometry/motion_estimation.hpp"
#include "stereo_slam/slam/tracked_pose.hpp"

namespace stereo_slam {

/// The motion that is expected of the next frame, and how far it is believed.
class MotionModel {
 public:
  /// The motion from the last frame to one with this stamp.
  [[nodiscard]] ExpectedMotion expected_until(std::int64_t stamp_ns) const;

  /// Time without a measured motion, see ConstantVelocity.
  [[nodiscard]] UnseenSteps unseen_until(std::int64_t stamp_ns) const {
    return velocity_.unseen_until(stamp_ns);
  }

  /// Whether a motion was measured.
  [[nodiscard]] bool known() const noexcept { return velocity_.known(); }

  /// Whether no motion in the last frames was a jerk, a sudden change. After one, the motion may be that of a
  /// vehicle.
  [[nodiscard]] bool steady() const noexcept { return jerks_.steady(); }

  /// Learns from a tracked frame. `T_keyframe_previous` is the posterior of the frame before, which was lost
  /// if `after_loss`.
  void learn(const TrackedPose& tracked, const Pose& T_keyframe_previous, bool after_loss,
             std::int64_t stamp_ns);

  /// Adds a frame whose pose is known, but not its motion.
  void found(std::int64_t stamp_ns) { velocity_.found(stamp_ns); }

 private:
  ConstantVelocity velocity_;
  JerkMonitor jerks_;
};

}  // namespace stereo_slam
