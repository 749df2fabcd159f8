// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/keyframe_trajectory.hpp"

#include <algorithm>
#include <cmath>

namespace stereo_slam {
namespace {

/// The share of each frame from `first` up to `end` in the error at `end`. The standard deviation of the
/// predicted position grows from frame to frame, and the error with it; at `end` it has grown as in the step
/// before.
[[nodiscard]] std::vector<double> shares(const std::vector<PoseGaussian>& poses, std::size_t first,
                                         std::size_t end) {
  const auto variance_m2 = [&](std::size_t i) {
    return poses[i].covariance.bottomRightCorner<3, 3>().trace();
  };
  std::vector<double> sigma_m{0.0};
  for (std::size_t i = first; i < end; ++i)
    sigma_m.push_back(std::sqrt(std::max(0.0, variance_m2(i) - variance_m2(first - 1))));
  const double at_end = 2.0 * sigma_m.back() - sigma_m[sigma_m.size() - 2];
  std::vector<double> result;
  for (std::size_t i = 1; i < sigma_m.size(); ++i) {
    const double equal = static_cast<double>(i) / static_cast<double>(sigma_m.size());
    result.push_back(at_end > 0.0 ? std::min(1.0, sigma_m[i] / at_end) : equal);
  }
  return result;
}

/// Bridges the frames from `first` up to `end`, which is the next tracked frame.
void bridge(std::vector<PoseGaussian>& poses, std::size_t first, std::size_t end) {
  const Pose last_step = poses[end - 2].pose.inverse() * poses[end - 1].pose;
  const Vector6<double> error = ((poses[end - 1].pose * last_step).inverse() * poses[end].pose).log();
  const std::vector<double> share_of = shares(poses, first, end);
  for (std::size_t i = first; i < end; ++i) {
    const double share = share_of[i - first];
    poses[i].pose = (poses[i].pose * Pose::exp(share * error)).renormalized();
    poses[i].covariance = (1.0 - share) * poses[i].covariance + share * poses[end].covariance;
  }
}

}  // namespace

void KeyframeTrajectory::append(const PoseGaussian& T_keyframe_camera, bool measured) {
  frames_.push_back({reference(), T_keyframe_camera, measured});
}

void KeyframeTrajectory::add_keyframe(std::size_t frame, const LevelledLink& link) {
  const auto& [T_previous_keyframe, tilt, levelling] = link;
  keyframes_.push_back(
      {frame, T_previous_keyframe, tilt, levelling, {}, frames_.size() - 1, frames_.back().measured});
  keyframes_.back().T_world_keyframe = composed(reference());
  T_odometry_keyframe_ = in_odometry_frame(T_previous_keyframe.pose);
  frames_.back() = {reference(), PoseGaussian{}};  // the keyframe's own frame moves with it
}

void KeyframeTrajectory::replace(std::size_t position, const PoseGaussian& T_keyframe_camera) {
  auto& frame = frames_[position];
  frame = {reference(), T_keyframe_camera, true, frame.recorded_covariance};
}

void KeyframeTrajectory::correct(const std::vector<LinkedPose>& T_world_keyframe) {
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    keyframes_[k].T_world_keyframe = k < T_world_keyframe.size() ? T_world_keyframe[k] : composed(k);
  }
}

/// The pose of a keyframe by that of the keyframe before. In the world of a loaded map the first keyframe is
/// uncertain: only the pose graph knows what its tilt has in common with that of this one.
LinkedPose KeyframeTrajectory::composed(std::size_t id) const {
  const KeyframePose& keyframe = keyframes_[id];
  const bool first_is_origin = keyframes_.front().T_world_keyframe.estimate.covariance.isZero(0.0);
  return add_link(keyframes_[id - 1].T_world_keyframe, keyframe.T_previous_keyframe, keyframe.measured,
                  first_is_origin ? keyframe.tilt : std::nullopt);
}

bool KeyframeTrajectory::spread_levelling() {
  bool any = false;
  Vector3<double> turn = Vector3<double>::Zero();  // of the keyframe by later ones
  for (std::size_t id = reference(); id > 0; --id) {
    auto& [frame, T_previous_keyframe, tilt, levelling, T_world_keyframe, position, measured] =
        keyframes_[id];
    if (tilt) tilt = turned(*tilt, turn);
    any = any || tilt;
    const Vector3<double> turn_here = turn + levelling.turn;
    turn = levelling.share_before * (T_previous_keyframe.pose.rotation_matrix() * turn_here);
  }
  return any;
}

/// Gives the path over the links the tilts of its keyframes.
void KeyframeTrajectory::level_links() {
  Pose T_first_keyframe = Pose::identity();
  for (KeyframePose& keyframe : keyframes_) {
    Pose& T_previous_keyframe = keyframe.T_previous_keyframe.pose;
    if (keyframe.tilt) {
      const Pose turn = levelling_turn(T_first_keyframe * T_previous_keyframe, *keyframe.tilt);
      T_previous_keyframe = (T_previous_keyframe * turn).renormalized();
    }
    T_first_keyframe = (T_first_keyframe * T_previous_keyframe).renormalized();
  }
}

std::vector<Pose> KeyframeTrajectory::motions() const {
  std::vector<Pose> result;
  for (std::size_t id = 1; id < keyframes_.size(); ++id)
    result.push_back(keyframes_[id].T_previous_keyframe.pose);
  return result;
}

std::vector<Pose> KeyframeTrajectory::relative_poses() const {
  std::vector<Pose> result;
  for (const FramePose& frame : frames_) result.push_back(frame.T_keyframe_camera.pose);
  return result;
}

/// Corrects the frames between the keyframes, which have their poses before the correction.
void KeyframeTrajectory::remeasure_frames(const std::vector<MotionChange>& changes,
                                          const std::vector<FrameChange>& frames) {
  std::vector<bool> done(frames_.size(), false);
  for (const KeyframePose& keyframe : keyframes_) done[keyframe.position] = true;  // moves with the keyframe
  const auto widen = [](FramePose& frame, const Matrix6<double>& covariance) {
    frame.T_keyframe_camera.covariance += covariance;
    frame.recorded_covariance += covariance;
  };
  for (const auto& [position, change] : frames) {
    if (done[position] || !change.is_corrected) continue;
    done[position] = true;
    FramePose& frame = frames_[position];
    frame.T_keyframe_camera.pose = change.of(frame.T_keyframe_camera.pose);
    widen(frame, change.nonlinearity - change.covariance_before);
    widen(frame, change.covariance);
  }
  // The correction grows with the length of the motion: any other frame gets its share of it.
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    FramePose& frame = frames_[i];
    if (done[i] || frame.keyframe == reference()) continue;
    const MotionChange& change = changes[frame.keyframe];
    const double length_m = keyframes_[frame.keyframe + 1].T_previous_keyframe.pose.translation().norm();
    const double part_m = frame.T_keyframe_camera.pose.translation().norm();
    if (part_m == 0.0 || length_m == 0.0) continue;
    const double share = std::min(part_m / length_m, 1.0);
    frame.T_keyframe_camera.pose = change.of(frame.T_keyframe_camera.pose, share);
    widen(frame, share * share * change.nonlinearity);
  }
}

std::vector<KeyframeLink> KeyframeTrajectory::remeasure(const std::vector<MotionChange>& changes,
                                                        const std::vector<FrameChange>& frames) {
  remeasure_frames(changes, frames);
  std::vector<KeyframeLink> changed;
  for (std::size_t id = 1; id < keyframes_.size(); ++id) {
    const MotionChange& change = changes[id - 1];
    PoseGaussian& T_previous_keyframe = keyframes_[id].T_previous_keyframe;
    if (!change.is_corrected) continue;
    T_previous_keyframe.pose = change.of(T_previous_keyframe.pose);
    T_previous_keyframe.covariance += change.nonlinearity - change.covariance_before;
    T_previous_keyframe.covariance += change.covariance;
  }
  level_links();
  for (std::size_t id = 1; id < keyframes_.size(); ++id) {
    const KeyframePose& keyframe = keyframes_[id];
    if (changes[id - 1].is_corrected || keyframe.tilt)
      changed.push_back({id, keyframe.T_previous_keyframe, keyframe.tilt});
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

void bridge_untracked(std::vector<PoseGaussian>& T_world_camera, const std::vector<bool>& tracked) {
  for (std::size_t i = 1; i < tracked.size(); ++i) {
    if (tracked[i] || !tracked[i - 1]) continue;
    const auto next = std::find(tracked.begin() + static_cast<std::ptrdiff_t>(i), tracked.end(), true);
    if (next != tracked.end()) bridge(T_world_camera, i, static_cast<std::size_t>(next - tracked.begin()));
  }
}

}  // namespace stereo_slam
