// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/constant_velocity.hpp"

#include <algorithm>
#include <cmath>

namespace stereo_slam {

void ConstantVelocity::Change::add(double change) {
  constexpr double kKept = 0.7;  // the standard deviation halves in four steps
  variance_ = std::max(kKept * variance_, change * change);
}

double ConstantVelocity::Change::sigma(double least) const { return std::hypot(least, std::sqrt(variance_)); }

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

ExpectedMotion ConstantVelocity::expected_until(std::int64_t stamp_ns) const {
  // A fifth of what may happen suddenly in a tenth of a second: a hand turns a camera by 1.7 degrees, and
  // 10 m/s^2 change its motion by 10 cm.
  constexpr double kLeastRotation_rad = 0.006, kLeastTranslation_m = 0.02;
  if (!known()) return {Pose::identity()};
  const auto [before, now] = unseen_until(stamp_ns);
  const double steps = before + now;
  return {motion_until(stamp_ns), steps * rotation_rad_.sigma(kLeastRotation_rad),
          steps * translation_m_.sigma(kLeastTranslation_m)};
}

UnseenSteps ConstantVelocity::unseen_until(std::int64_t stamp_ns) const {
  return {unseen_steps_, std::max(1.0, steps_until(stamp_ns))};
}

void ConstantVelocity::measured(std::int64_t stamp_ns, const Pose& T_previous_current) {
  const double steps = unseen_steps_ + unseen_until(stamp_ns).now;
  const Vector6<double> change = T_previous_current.boxminus(motion_until(stamp_ns)) / steps;
  rotation_rad_.add(change.head<3>().norm());
  translation_m_.add(change.tail<3>().norm());
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
