// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/keyframes/keyframe_database.hpp"
#include "stereo_slam/local_map/local_map.hpp"
#include "stereo_slam/loop_closing/loop_closer.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/slam/global_map.hpp"
#include "stereo_slam/slam/keyframe_trajectory.hpp"
#include "stereo_slam/slam/segment_state.hpp"

namespace stereo_slam {

/// Where the camera was, and the landmarks that it left behind: all poses, the map segment, and the landmarks
/// in the world. Poses of frames are relative to keyframes, which loops move.
class Path {
 public:
  Path() = default;
  /// In the world of an earlier run, where this one is not localised yet.
  explicit Path(const SavedMap& loaded)
      : segment_(SegmentState::in_loaded_map()), global_map_(GlobalMap(loaded)) {}

  /// Makes `frame` the first keyframe, whose camera is the world's frame.
  void begin(std::size_t frame) { trajectory_.begin(frame); }

  /// Appends the pose of the next frame relative to the reference keyframe, and writes it into the result.
  /// `measured` is false for a predicted pose.
  void append(const PoseGaussian& T_keyframe_camera, bool measured, const CalibrationError& error,
              FrameResult& result);

  /// Appends a frame before the first keyframe, of which nothing is known.
  void append_unknown(const CalibrationError& error, FrameResult& result);

  /// Makes the last frame the reference keyframe, see KeyframeTrajectory.
  void add_keyframe(std::size_t frame, const PoseGaussian& T_previous_keyframe,
                    const RectificationEffect& effect) {
    trajectory_.add_keyframe(frame, T_previous_keyframe, effect);
  }

  /// Replaces the covariances in the result of the last frame by those of the keyframe that it became.
  void report_keyframe(FrameResult& result) const;

  /// Begins a map segment: where the last frame is, is a guess from here on.
  void begin_segment() { segment_.begin_next(); }

  /// Replaces the pose of an earlier frame by one relative to the reference keyframe.
  void replace(std::size_t position, const PoseGaussian& T_keyframe_camera) {
    trajectory_.replace(position, T_keyframe_camera);
  }

  /// Keeps the path in the odometry frame continuous, see KeyframeTrajectory.
  void continue_odometry(const Pose& expected, const Pose& found) {
    trajectory_.continue_odometry(expected, found);
  }

  /// Moves the keyframes, and what is relative to them.
  void correct(const LoopCorrection& correction);

  /// Corrects all motions to the present estimate of the rectification, see KeyframeTrajectory.
  std::vector<KeyframeLink> remeasure(const RectificationEstimator& rectification) {
    return trajectory_.remeasure(rectification);
  }

  [[nodiscard]] SegmentState& segment() noexcept { return segment_; }
  [[nodiscard]] const SegmentState& segment() const noexcept { return segment_; }
  [[nodiscard]] const KeyframeTrajectory& keyframes() const noexcept { return trajectory_; }
  /// Number of frames so far.
  [[nodiscard]] std::size_t frames() const noexcept { return trajectory_.frames(); }

  /// T_world_camera of every frame so far, with the errors that all frames share.
  [[nodiscard]] std::vector<PoseGaussian> poses(const CalibrationError& error) const;

  /// All landmarks in the world, with those of a loaded map once a segment is localised in it.
  [[nodiscard]] std::vector<MapPoint> map_points(const LocalMap& local_map) const {
    return global_map_.all(local_map, trajectory_, segment_.any_localised());
  }
  /// The same with those of the loaded map in any case.
  [[nodiscard]] std::vector<MapPoint> map_points_to_save(const LocalMap& local_map) const {
    return global_map_.all(local_map, trajectory_, /*with_loaded=*/true);
  }
  /// Those that have left the local map.
  [[nodiscard]] const std::vector<MapPoint>& archived_map_points(const LocalMap& local_map) {
    return global_map_.archived(local_map, trajectory_, segment_.any_localised());
  }

 private:
  [[nodiscard]] PoseGaussian in_world(const PoseGaussian& T_keyframe_camera,
                                      const CalibrationError& error) const;

  KeyframeTrajectory trajectory_;
  SegmentState segment_;
  GlobalMap global_map_;
};

}  // namespace stereo_slam
