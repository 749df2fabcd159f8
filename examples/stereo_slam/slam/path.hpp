// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/local_map.hpp"
#include "stereo_slam/loop_closing/async_loop_closer.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/loop_closing/loop_closer.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/rig/seen_motion.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/slam/global_map.hpp"
#include "stereo_slam/slam/keyframe_trajectory.hpp"
#include "stereo_slam/slam/segment_state.hpp"

namespace stereo_slam {

/// Where the camera was: the poses of keyframes in the world and of all frames relative to them, the map
/// segment, and the loops, which move keyframes. It converts landmarks to world coordinates.
class Path {
 public:
  /// Without loops.
  Path() = default;
  /// With loops. If `loaded` has keyframes, poses get into its world once a loop localises the run there.
  Path(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread, const SavedMap& loaded,
       MapUse use);

  /// Appends the pose of the next frame relative to the reference keyframe, and writes it into the result.
  /// `measured` is false for a predicted pose.
  void append(const PoseGaussian& T_keyframe_camera, bool measured, const CalibrationError& error,
              FrameResult& result);

  /// Appends a frame before the first keyframe, of which nothing is known.
  void append_unknown(const CalibrationError& error, FrameResult& result);

  /// Moves the keyframes by the loop correction that is due before this frame. Returns whether there is one.
  bool correct_before(std::size_t frame);

  /// Gives the points of the reference keyframe to the loop closing; `left` is its image.
  void search_loops(const Keyframe& keyframe, const cv::Mat& left, const LensResidual& lens);

  /// Replaces the covariances in the result of the last frame by those of the keyframe that it became, and
  /// the pose if gravity told its tilt.
  void report_keyframe(FrameResult& result) const;

  /// After the last frame: corrects the motions between keyframes, and frames between them, by what was
  /// learned of the rig, if anything was, and applies the loop corrections that are still being computed.
  void finish(const std::vector<MotionChange>& learned, const std::vector<FrameChange>& frames);

  [[nodiscard]] SegmentState& segment() noexcept { return segment_; }
  [[nodiscard]] KeyframeTrajectory& trajectory() noexcept { return trajectory_; }
  [[nodiscard]] const KeyframeTrajectory& trajectory() const noexcept { return trajectory_; }
  /// Number of frames so far.
  [[nodiscard]] std::size_t frames() const noexcept { return trajectory_.frames(); }

  /// T_world_camera of every frame so far, with the errors that all frames share.
  [[nodiscard]] std::vector<PoseGaussian> poses(const CalibrationError& error) const;

  /// The established landmarks in the world, with those of a loaded map once a segment is localised in it.
  [[nodiscard]] std::vector<MapPoint> map_points(const LocalMap& local_map) const {
    return global_map_.all(local_map, trajectory_, segment_.any_localised());
  }
  /// Those that have left the local map.
  [[nodiscard]] const std::vector<MapPoint>& archived_map_points(const LocalMap& local_map) {
    return global_map_.archived(local_map, trajectory_, segment_.any_localised());
  }

  /// What searches for loops; null without loop closing.
  [[nodiscard]] const AsyncLoopCloser* loops() const noexcept { return loops_.get(); }
  /// Sets the keyframes, the loops and the landmarks of `map`. Throws std::logic_error without loop closing.
  void save(const LocalMap& local_map, SavedMap& map) const;

 private:
  [[nodiscard]] PoseGaussian in_world(const PoseGaussian& T_keyframe_camera,
                                      const CalibrationError& error) const;
  void correct(const LoopCorrection& correction);

  KeyframeTrajectory trajectory_;
  SegmentState segment_;
  GlobalMap global_map_;
  std::unique_ptr<AsyncLoopCloser> loops_;
};

}  // namespace stereo_slam
