// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/constant_velocity.hpp"

#include <algorithm>

namespace stereo_slam {

double ConstantVelocity::steps_until(std::int64_t stamp_ns) const {
  if (step_ns_ <= 0.0 || stamp_ns <= stamp_ns_) return 1.0;
  const double since_ns = static_cast<double>(stamp_ns) - static_cast<double>(stamp_ns_);
  return std::min(since_ns / step_ns_, kLongest_steps);
}

Pose ConstantVelocity::motion_until(std::int64_t stamp_ns) const {
  const double steps = steps_until(stamp_ns);
  if (unseen_steps_ + steps > kLongest_steps) return Pose::identity();
  return Pose::exp(steps * per_step_);
}

UnseenSteps ConstantVelocity::unseen_until(std::int64_t stamp_ns) const {
  return {unseen_steps_, std::max(1.0, steps_until(stamp_ns))};
}

void ConstantVelocity::measured(std::int64_t stamp_ns, const Pose& T_previous_current) {
  per_step_ = T_previous_current.log();
  step_ns_ = static_cast<double>(stamp_ns) - static_cast<double>(stamp_ns_);
  found(stamp_ns);
}

void ConstantVelocity::unmeasured(std::int64_t stamp_ns) {
  unseen_steps_ += unseen_until(stamp_ns).now;
  stamp_ns_ = stamp_ns;
}

void ConstantVelocity::found(std::int64_t stamp_ns) {
  unseen_steps_ = 0.0;
  stamp_ns_ = stamp_ns;
}

}  // namespace stereo_slam
