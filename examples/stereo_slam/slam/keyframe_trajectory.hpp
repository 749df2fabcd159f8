// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/tilt_measurement.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/rig/seen_motion.hpp"

namespace stereo_slam {

/// Poses of all frames: keyframes in the world, every frame relative to its keyframe.
///
/// The last keyframe is the reference of the filter's state. A loop correction moves keyframes, and their
/// frames with them. Poses relative to keyframes change in two cases: a new map segment takes the last frame
/// as its own, and at the end the best estimate of the rectification is applied.
class KeyframeTrajectory {
 public:
  /// Makes `frame` the first keyframe, whose camera is the world's frame.
  void begin(std::size_t frame) {
    keyframes_.front().frame = frame;
    keyframes_.front().position = frames_.size();
  }

  /// Appends the pose of the next frame relative to the reference keyframe. `measured` is false for a
  /// predicted pose.
  void append(const PoseGaussian& T_keyframe_camera, bool measured);

  /// Makes the last frame, input frame `frame`, the reference keyframe. The link is its pose relative to the
  /// last keyframe.
  void add_keyframe(std::size_t frame, const LevelledLink& link);

  /// Replaces the pose of an earlier frame by one relative to the reference keyframe. The frame counts as
  /// measured then.
  void replace(std::size_t position, const PoseGaussian& T_keyframe_camera);

  /// Sets the poses of the first keyframes; the others keep their poses relative to those before them.
  void correct(const std::vector<LinkedPose>& T_world_keyframe);

  /// Corrects the motions from keyframe to keyframe, in order, by what was learned of the rig since they were
  /// measured, and the frames between them: those of `frames` by their own changes, others by a share. The
  /// poses in the world are composed anew from the relative poses, without loop corrections. Returns the
  /// keyframes whose pose relative to the keyframe before changed, in order.
  std::vector<KeyframeLink> remeasure(const std::vector<MotionChange>& changes,
                                      const std::vector<FrameChange>& frames = {});

  /// Spreads the levelling of each keyframe over the keyframes before, which share the error that it
  /// corrects. The poses follow with remeasure(). Returns whether there are tilts.
  bool spread_levelling();

  /// Keeps the path in the odometry frame, which no loop corrects, continuous over a relocalisation: the path
  /// goes on from the predicted pose `expected`, not from the measured one, `found`. Both are
  /// T_keyframe_camera.
  void continue_odometry(const Pose& expected, const Pose& found);

  /// The motions from keyframe to keyframe, in order.
  [[nodiscard]] std::vector<Pose> motions() const;
  /// The poses of all frames relative to their keyframes.
  [[nodiscard]] std::vector<Pose> relative_poses() const;

  [[nodiscard]] std::size_t frames() const noexcept { return frames_.size(); }
  /// T_keyframe_camera of the last frame.
  [[nodiscard]] const Pose& T_keyframe_last() const { return frames_.back().T_keyframe_camera.pose; }
  /// Id of the reference keyframe.
  [[nodiscard]] std::size_t reference() const noexcept { return keyframes_.size() - 1; }
  /// Index of the input frame that became the reference keyframe.
  [[nodiscard]] std::size_t reference_frame() const noexcept { return keyframes_.back().frame; }
  [[nodiscard]] const PoseGaussian& T_previous_reference() const noexcept {
    return keyframes_.back().T_previous_keyframe;
  }
  [[nodiscard]] const std::optional<TiltMeasurement>& tilt_of_reference() const noexcept {
    return keyframes_.back().tilt;
  }
  [[nodiscard]] const Pose& T_world_keyframe(std::size_t id) const {
    return keyframes_[id].T_world_keyframe.estimate.pose;
  }

  /// T_world_camera of the last frame, which is at this pose relative to the reference keyframe.
  [[nodiscard]] LinkedPose in_world(const PoseGaussian& T_keyframe_camera) const;
  /// T_odometry_camera of the same frame, on the path that never jumps.
  [[nodiscard]] Pose in_odometry_frame(const Pose& T_keyframe_camera) const;

  /// Covariance of every frame relative to the keyframe that it was recorded with, or of a keyframe's own
  /// frame relative to the keyframe before, as known now.
  [[nodiscard]] std::vector<Matrix6<double>> relative_covariances() const;

  /// T_world_camera of every frame as known now; predicted frames lie between their measured neighbours.
  /// Their covariances contain the common error of the links (LinkedPose).
  [[nodiscard]] std::vector<PoseGaussian> poses(double common_error_rad) const;

 private:
  struct KeyframePose {
    std::size_t frame = 0;
    PoseGaussian T_previous_keyframe;
    std::optional<TiltMeasurement> tilt{};  ///< relative to the first keyframe
    Levelling levelling{};                  ///< of the link
    LinkedPose T_world_keyframe;
    std::size_t position = 0;  ///< of its own frame in frames_
    bool measured = true;      ///< T_previous_keyframe was measured, not only predicted
  };
  struct FramePose {
    std::size_t keyframe = 0;
    PoseGaussian T_keyframe_camera;
    bool measured = true;
    /// Of the pose relative to the keyframe that was the reference when the frame was recorded.
    Matrix6<double> recorded_covariance = T_keyframe_camera.covariance;
  };

  [[nodiscard]] LinkedPose composed(std::size_t id) const;
  void level_links();
  void remeasure_frames(const std::vector<MotionChange>& changes, const std::vector<FrameChange>& frames);

  std::vector<KeyframePose> keyframes_{1};
  std::vector<FramePose> frames_;
  Pose T_odometry_keyframe_ = Pose::identity();  // the reference keyframe without loop corrections
};

/// Distributes the prediction error over untracked frames.
///
/// Untracked frames were predicted from the tracked frame before them. Each takes a share of the error at the
/// next tracked frame, in proportion to the standard deviation of its predicted position, and its covariance
/// is interpolated between its own and that of the tracked frame. Untracked frames at the end keep their
/// predicted poses. `tracked` has one value a pose.
void bridge_untracked(std::vector<PoseGaussian>& T_world_camera, const std::vector<bool>& tracked);

}  // namespace stereo_slam
