// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "stereo_slam/core/landmark_track.hpp"
#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/frontend/repetition.hpp"
#include "stereo_slam/frontend/stereo_view.hpp"
#include "stereo_slam/local_map/local_map.hpp"
#include "stereo_slam/local_map/reobserved_landmarks.hpp"
#include "stereo_slam/loop_closing/async_loop_closer.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/odometry/constant_velocity.hpp"
#include "stereo_slam/odometry/jerk_monitor.hpp"
#include "stereo_slam/odometry/odometry.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/slam/frame_images.hpp"
#include "stereo_slam/slam/frontend.hpp"
#include "stereo_slam/slam/global_map.hpp"
#include "stereo_slam/slam/judgement.hpp"
#include "stereo_slam/slam/keyframe_trajectory.hpp"
#include "stereo_slam/slam/noise_scale.hpp"
#include "stereo_slam/slam/relocalisation.hpp"
#include "stereo_slam/slam/right_image_monitor.hpp"
#include "stereo_slam/slam/segment_state.hpp"
#include "stereo_slam/slam/stage_clock.hpp"
#include "stereo_slam/slam/tracked_pose.hpp"

namespace stereo_slam {

struct AssociationTrace;

/// The stereo SLAM of the DQV-SLAM paper's Fig. 2.
///
/// The state of the filter is the pose of the camera relative to a reference keyframe. Landmarks are relative
/// to this keyframe too. Frames go in one by one, in order. Reads and writes no files. Runs on OpenCV's
/// threads and on one for loop closing; the results do not depend on the threads.
class Slam {
 public:
  Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread = LoopThread::kNone);

  /// Starts with the map of an earlier run. Until a loop localises this run in it, poses are relative to this
  /// run's first camera, with status kWeak; then they are relative to the map's world, from status
  /// kRelocalised on. Throws std::invalid_argument for settings without loop closure, and for the map of
  /// another camera.
  Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread, const SavedMap& loaded,
       MapUse use);

  /// Tracks one rectified frame and updates the map. Every frame gets a pose; its status says what the pose
  /// was measured against. Fills `trace`, if there is one, with how landmarks were searched for.
  FrameResult process(const StereoFrame& recorded, AssociationTrace* trace = nullptr);

  /// Call after the last frame: applies the loop corrections that are still being computed, and corrects all
  /// measured motions to the last estimate of the rectification, to first order.
  void finish();

  /// T_world_camera of every frame so far. A loop closure may have moved earlier ones.
  [[nodiscard]] std::vector<PoseGaussian> trajectory() const;

  /// FrameResult::relative_covariance of every frame so far, as known now: finish() changes it.
  [[nodiscard]] std::vector<Matrix6<double>> relative_covariances() const {
    return trajectory_.relative_covariances();
  }

  /// Errors of the calibration that all frames share, as known now.
  [[nodiscard]] CalibrationError calibration_error() const;

  /// Horizontal displacement of the right image that its rows do not show, at the principal point; zero as
  /// long as the calibration seems right, px.
  [[nodiscard]] double right_image_displacement_px() const {
    return rectification_.has_large_error() ? rectification_.current().coefficients()(0, 0) : 0.0;
  }

  /// All landmarks so far in world coordinates, with those of a loaded map once the run is localised in it.
  /// Complete after finish().
  [[nodiscard]] std::vector<MapPoint> map_points() const;

  /// The same without the landmarks of the reference keyframe, for display: brought up to date and not
  /// copied. Valid until the next call of a function that is not const.
  [[nodiscard]] const std::vector<MapPoint>& archived_map_points();

  /// The landmarks of the reference keyframe that are in view of the last frame.
  [[nodiscard]] std::vector<LandmarkTrack> landmark_tracks() const;

  /// The map for a later run, with the one that this run started with; complete after finish(). Throws
  /// std::logic_error without loop closure, which keeps the keyframes.
  [[nodiscard]] SavedMap saved_map() const;

  /// Loops so far, accepted and refused; complete after finish().
  [[nodiscard]] std::vector<LoopEvent> loop_events() const;

  /// The same without waiting: nothing while the loop-closing thread works.
  [[nodiscard]] std::optional<std::span<const LoopEvent>> loop_events_if_idle() const;

  /// Memory that loop closure uses for keyframes and place recognition, bytes; zero without loop closure.
  [[nodiscard]] std::size_t keyframe_memory_bytes() const;

 private:
  [[nodiscard]] bool anchored() const { return settings_.map.layout == MapLayout::kAnchored; }
  [[nodiscard]] bool tracks_correlation() const;

  /// Whether tracking uses the odometry alone. Landmarks still measure the pose if a keyframe is recognised.
  [[nodiscard]] bool odometry_only() const { return settings_.update.method == PoseUpdateMethod::kNone; }

  /// Whether the landmarks were searched where the pose is, so that those found fit it.
  [[nodiscard]] bool fits_landmarks(const TrackedPose& tracked) const {
    return tracked.basis == PoseBasis::kLandmarks ||
           (odometry_only() && tracked.basis == PoseBasis::kOdometry);
  }

  /// Whether the right image of the frame is left out, as far as the frame was processed.
  [[nodiscard]] bool ignores_right_image() const { return right_image_.judgement() == RightImage::kIgnored; }

  /// A frame as the camera and the rectification at hand measure it.
  [[nodiscard]] StereoView view_of(const StereoFrame& frame) const {
    return {frame, camera_, rectification_.current(), !ignores_right_image()};
  }

  bool apply(const std::optional<LoopCorrection>& correction);

  // The stages of process(), in its order.
  [[nodiscard]] OdometryResult measure_motion(const FrameImages& images);
  [[nodiscard]] PoseDensity predict(const OdometryResult& odometry, std::int64_t stamp_ns);
  [[nodiscard]] std::vector<Match> find_landmarks(const FrameImages& images, const PoseDensity& prior,
                                                  const OdometryResult& odometry, AssociationTrace* trace);
  [[nodiscard]] TrackedPose update(const PoseDensity& prior, const OdometryResult& odometry,
                                   std::vector<Match> matches);
  [[nodiscard]] bool jumps(const Pose& predicted, const Pose& measured) const;
  [[nodiscard]] std::optional<PoseDensity> relocalise(const FrameImages& images,
                                                      const PoseDensity& prior) const;
  void integrate(const TrackedPose& tracked, const FrameImages& images, FrameResult& result);
  void note_static_points(const TrackedPose& tracked);
  void prepare_next(const FrameImages& images, const std::vector<Match>& matches, const FrameResult& result);

  // The unusual cases: a repeated or missing image, and no map yet.
  [[nodiscard]] bool can_measure(const StereoFrame& frame) const;
  void pass_over(const StereoFrame& frame, FrameResult& result, const StageClock& clock);
  void initialise(const FrameImages& images, FrameResult& result);
  void record_unknown(FrameResult& result);

  [[nodiscard]] PoseGaussian reported(const TrackedPose& tracked) const;
  void record(const PoseGaussian& T_keyframe_camera, bool measured, FrameResult& result);
  [[nodiscard]] PoseGaussian in_world(const PoseGaussian& T_keyframe_camera,
                                      const CalibrationError& error) const;
  void record_keyframe(FrameResult& result) const;
  void complete(const FrameImages& images, FrameEvidence evidence, FrameResult& result);
  void learn_velocity(const TrackedPose& tracked, std::int64_t stamp_ns);

  // The map and its keyframes.
  bool extend_map(const TrackedPose& tracked, const FrameImages& images);
  [[nodiscard]] bool needs_keyframe(std::size_t frame, std::size_t matches) const;
  void begin_segment(const FrameImages& images, const TrackedPose& tracked);
  void change_keyframe(const FrameImages& images, PoseGaussian T_previous_keyframe,
                       const std::vector<Match>& matches, const OdometryResult& odometry);
  void begin_keyframe(const FrameImages& images, std::vector<KeyframePoint> points);
  [[nodiscard]] std::vector<KeyframePoint> add_landmarks(const FrameImages& images,
                                                         const std::vector<Vector2<double>>& reserved_px,
                                                         const ReobservedLandmarks& reobserved = {});
  RectificationEffect refine_rectification(const std::vector<Match>& matches, const OdometryResult& odometry);
  [[nodiscard]] bool relearn_rows(const StereoFrame& frame);

  static constexpr int kRelearnInterval = 10;  // frames

  StereoCamera camera_;
  Settings settings_;

  std::unique_ptr<Frontend> frontend_;
  PoseDensity posterior_;          // T_keyframe_camera of the last frame: the state of the filter
  LocalMap local_map_;             // landmarks of the reference keyframe
  ReferenceKeyframe reference_;    // its image and points
  SceneRepetition scene_;          // whether that image is ambiguous
  KeyframeTrajectory trajectory_;  // poses of keyframes and frames
  GlobalMap global_map_;           // landmarks in world coordinates
  SegmentState segment_;           // whether their place in the world is known
  RectificationEstimator rectification_;
  ConstantVelocity velocity_;
  JerkMonitor jerks_;
  NoiseScale noise_;  // of the landmarks' measurements
  RightImageMonitor right_image_;
  PreviousFrame previous_;
  std::optional<AsyncLoopCloser> loops_;
  bool started_ = false;          // there is a map
  int frames_without_right_ = 0;  // in a row, that were lost or whose right image did not fit
};

}  // namespace stereo_slam
