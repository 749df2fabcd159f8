// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/motion_model.hpp"

namespace stereo_slam {

ExpectedMotion MotionModel::expected_until(std::int64_t stamp_ns) const {
  ExpectedMotion expected{velocity_.motion_until(stamp_ns), Expectation::kNoMotion};
  if (velocity_.known()) expected.expectation = steady() ? Expectation::kSteady : Expectation::kDoubtful;
  return expected;
}

void MotionModel::learn(const TrackedPose& tracked, const Pose& T_keyframe_previous, bool after_loss,
                        std::int64_t stamp_ns) {
  jerks_.add(tracked.odometry.jerk);
  if (!tracked.measured()) {
    velocity_.unmeasured(stamp_ns);
  } else if (tracked.basis == PoseBasis::kLandmarks && !after_loss) {
    velocity_.measured(stamp_ns, T_keyframe_previous.inverse() * tracked.posterior.pose);
  } else if (tracked.odometry.valid) {
    velocity_.measured(stamp_ns, tracked.odometry.T_previous_current.pose);
  } else {
    velocity_.found(stamp_ns);
  }
}

}  // namespace stereo_slam
