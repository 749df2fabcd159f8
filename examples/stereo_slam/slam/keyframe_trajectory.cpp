// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/keyframe_trajectory.hpp"

#include <algorithm>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/slam/bridging.hpp"

namespace stereo_slam {

void KeyframeTrajectory::append(const PoseGaussian& T_keyframe_camera, bool measured) {
  frames_.push_back({reference(), T_keyframe_camera, measured});
}

void KeyframeTrajectory::add_keyframe(std::size_t frame, const PoseGaussian& T_previous_keyframe,
                                      const RectificationEffect& effect) {
  const bool measured = frames_.back().measured;
  const LinkedPose T_world_keyframe =
      add_link(keyframes_.back().T_world_keyframe, T_previous_keyframe, measured);
  keyframes_.push_back({frame, T_previous_keyframe, T_world_keyframe, effect, frames_.size() - 1, measured});
  T_odometry_keyframe_ = in_odometry_frame(T_previous_keyframe.pose);
  frames_.back() = {reference(), PoseGaussian{}};  // the keyframe's own frame moves with it
}

void KeyframeTrajectory::replace(std::size_t position, const PoseGaussian& T_keyframe_camera) {
  auto& frame = frames_[position];
  frame = {reference(), T_keyframe_camera, true, frame.recorded_covariance};
}

void KeyframeTrajectory::correct(const std::vector<LinkedPose>& T_world_keyframe) {
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    auto& keyframe = keyframes_[k];
    keyframe.T_world_keyframe =
        k < T_world_keyframe.size()
            ? T_world_keyframe[k]
            : add_link(keyframes_[k - 1].T_world_keyframe, keyframe.T_previous_keyframe, keyframe.measured);
  }
}

std::vector<KeyframeLink> KeyframeTrajectory::remeasure(const RectificationEstimator& rectification) {
  // The correction grows with the length of the motion: a frame between two keyframes gets its share of it.
  for (auto& frame : frames_) {
    if (frame.keyframe == reference()) continue;
    const KeyframePose& next = keyframes_[frame.keyframe + 1];
    const double length_m = next.T_previous_keyframe.pose.translation().norm();
    const double part_m = frame.T_keyframe_camera.pose.translation().norm();
    if (part_m == 0.0 || length_m == 0.0) continue;
    const double share = std::min(part_m / length_m, 1.0);
    Pose& pose = frame.T_keyframe_camera.pose;
    pose = pose.boxplus(share * rectification.change_of(next.effect)).renormalized();
    const Matrix6<double> error = share * share * rectification.nonlinearity_of(next.effect);
    frame.T_keyframe_camera.covariance += error;
    frame.recorded_covariance += error;
  }
  std::vector<KeyframeLink> changed;
  for (std::size_t id = 1; id < keyframes_.size(); ++id) {
    auto& [frame, T_previous_keyframe, T_world_keyframe, effect, position, measured] = keyframes_[id];
    if (effect.derivative.isZero(0.0) || effect.vibrates) continue;
    T_previous_keyframe.pose =
        T_previous_keyframe.pose.boxplus(rectification.change_of(effect)).renormalized();
    T_previous_keyframe.covariance += rectification.nonlinearity_of(effect) - effect.covariance;
    effect.applied = rectification.coefficients_during(effect);
    effect.covariance = rectification.covariance_besides_scale(effect, T_previous_keyframe.pose);
    T_previous_keyframe.covariance += effect.covariance;
    changed.push_back({id, T_previous_keyframe});
  }
  correct({keyframes_.front().T_world_keyframe});
  return changed;
}

void KeyframeTrajectory::continue_odometry(const Pose& expected, const Pose& found) {
  T_odometry_keyframe_ = (T_odometry_keyframe_ * expected * found.inverse()).renormalized();
}

LinkedPose KeyframeTrajectory::in_world(const PoseGaussian& T_keyframe_camera) const {
  return compose(keyframes_.back().T_world_keyframe, T_keyframe_camera);
}

Pose KeyframeTrajectory::in_odometry_frame(const Pose& T_keyframe_camera) const {
  return (T_odometry_keyframe_ * T_keyframe_camera).renormalized();
}

std::vector<Matrix6<double>> KeyframeTrajectory::relative_covariances() const {
  std::vector<Matrix6<double>> covariances;
  for (const auto& frame : frames_) covariances.push_back(frame.recorded_covariance);
  for (std::size_t id = 1; id < keyframes_.size(); ++id) {
    covariances[keyframes_[id].position] = keyframes_[id].T_previous_keyframe.covariance;
  }
  return covariances;
}

std::vector<PoseGaussian> KeyframeTrajectory::poses(double common_error_rad) const {
  std::vector<PoseGaussian> T_world_camera;
  std::vector<bool> measured;
  for (const FramePose& frame : frames_) {
    const LinkedPose& T_world_keyframe = keyframes_[frame.keyframe].T_world_keyframe;
    T_world_camera.push_back(
        compose(T_world_keyframe, frame.T_keyframe_camera).with_common_error(common_error_rad));
    measured.push_back(frame.measured);
  }
  bridge_untracked(T_world_camera, measured);
  return T_world_camera;
}

}  // namespace stereo_slam
