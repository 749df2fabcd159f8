// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/motion_model.hpp"

#include "stereo_slam/slam/judgement.hpp"
#include "stereo_slam/tracking/predict.hpp"

namespace stereo_slam {

ExpectedMotion MotionModel::expected_until(std::int64_t stamp_ns) const {
  // Per frame: a drift of 3 degrees a second and a velocity that is wrong by .4 m/s, at 20 frames a second,
  // are far more than the errors of an IMU that was not given up.
  constexpr double kImuRotation_rad = 0.003, kImuTranslation_m = 0.02;
  const UnseenSteps unseen = unseen_until(stamp_ns);
  const double steps = unseen.before + unseen.now;
  if (inertial_.predicted())
    return {inertial_.predicted_motion(), steps * kImuRotation_rad, steps * kImuTranslation_m};
  return velocity_.expected_until(stamp_ns);
}

PoseGaussian MotionModel::guessed_until(std::int64_t stamp_ns, const MotionSettings& settings) const {
  return guessed_motion(expected_until(stamp_ns), settings, unseen_until(stamp_ns));
}

PoseGaussian MotionModel::motion_before_first(const Pose& T_last_current, std::int64_t stamp_ns,
                                              const MotionSettings& settings) const {
  const double steps = unseen_until(stamp_ns).before;
  return guessed_motion({Pose::exp(steps * T_last_current.log())}, settings, {.now = steps});
}

std::optional<RigVelocity> MotionModel::velocity() const {
  if (!velocity_.known()) return std::nullopt;
  const double step_s = 1e-9 * velocity_.step_ns();
  return RigVelocity{velocity_.per_step() / step_s, step_s};
}

std::optional<RigVelocity> MotionModel::velocity_by(const Pose& T_last_current, std::int64_t stamp_ns) const {
  if (stamp_ns <= velocity_.stamp_ns()) return std::nullopt;
  const double step_s = 1e-9 * static_cast<double>(stamp_ns - velocity_.stamp_ns());
  return RigVelocity{T_last_current.log() / step_s, step_s};
}

void MotionModel::learn(const TrackedPose& tracked, const PoseGaussian& T_keyframe_camera,
                        const Pose& T_keyframe_previous, bool after_loss, std::int64_t stamp_ns) {
  const Pose T_previous_current = T_keyframe_previous.inverse() * tracked.update.posterior.pose;
  const bool surprises = expected_until(stamp_ns).surprised_by(T_previous_current);
  const bool begins = surprises && tracked.odometry.contradicted();
  in_doubt_ = tracked.odometry.of_minority() && (in_doubt_ || begins);
  if (!tracked.measured()) {
    velocity_.unmeasured(stamp_ns);
  } else if (tracked.basis() == PoseBasis::kLandmarks && !after_loss) {
    velocity_.measured(stamp_ns, T_previous_current);
  } else if (tracked.odometry.valid) {
    velocity_.measured(stamp_ns, tracked.odometry.T_previous_current.pose);
  } else {
    velocity_.found(stamp_ns);
  }
  learn_inertially(tracked, T_keyframe_camera, T_keyframe_previous, after_loss, stamp_ns);
}

void MotionModel::learn_inertially(const TrackedPose& tracked, const PoseGaussian& T_keyframe_camera,
                                   const Pose& T_keyframe_previous, bool after_loss, std::int64_t stamp_ns) {
  if (inertial_.summary().phase == InertialPhase::kNone) return;
  const bool by_landmarks = tracked.basis() == PoseBasis::kLandmarks;
  const bool relocalised = found_again(tracked.basis(), after_loss);
  SeenFrame seen{.stamp_ns = stamp_ns,
                 .T_keyframe_camera = T_keyframe_camera,
                 .by_landmarks = by_landmarks,
                 .relocalised = relocalised,
                 .refutes_imu = tracked.refutes_imu};
  if (tracked.odometry.valid && !relocalised) {
    seen.T_previous_current = tracked.odometry.T_previous_current;
    if (by_landmarks) seen.T_previous_current->pose = T_keyframe_previous.inverse() * T_keyframe_camera.pose;
  }
  inertial_.end_frame(seen, tracked.inertial);
}

void MotionModel::begin_map(std::int64_t stamp_ns) {
  velocity_.found(stamp_ns);
  inertial_.begin_map(stamp_ns);
}

}  // namespace stereo_slam
