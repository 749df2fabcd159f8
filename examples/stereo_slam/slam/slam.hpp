// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/plane_warp.hpp"
#include "stereo_slam/local_map/reobserved_landmarks.hpp"
#include "stereo_slam/loop_closing/async_loop_closer.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/odometry/odometry.hpp"
#include "stereo_slam/odometry/point_tracks.hpp"
#include "stereo_slam/rig/right_camera.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/slam/frame_images.hpp"
#include "stereo_slam/slam/judgement.hpp"
#include "stereo_slam/slam/motion_model.hpp"
#include "stereo_slam/slam/relocalisation.hpp"
#include "stereo_slam/slam/slam_system.hpp"
#include "stereo_slam/slam/stage_clock.hpp"
#include "stereo_slam/slam/tracked_pose.hpp"

namespace stereo_slam {

/// The stereo SLAM. Its steps are those of the DQV-SLAM paper's Fig. 2.
///
/// The state of the filter is the pose of the camera relative to a reference keyframe, with a Gaussian error:
/// a closed-form prediction, and antipode::quadratic_update with 57 points (preset `fast`:
/// antipode::robust_least_squares). Landmarks are relative to the keyframe too. They are found in a frame by
/// aligning patches of the keyframe's image. Loop closing corrects the poses of keyframes. Runs on OpenCV's
/// threads and, if asked for, on one of its own for loop closing.
/// With `--preset odometry` the landmarks are searched, but do not correct the pose: a baseline for the
/// filter.
class Slam final : public SlamSystem {
 public:
  Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread = LoopThread::kNone);

  /// Starts with the map of an earlier run. Until a loop localises this run in it, poses are relative to this
  /// run's first camera, with status kWeak; then they are relative to the map's world, from status
  /// kRelocalised on. A map without keyframes is what an earlier run learned of the cameras. Throws
  /// std::invalid_argument for a map with keyframes and settings without loop closure, and for the map of
  /// another camera.
  Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread, const SavedMap& loaded,
       MapUse use);

  FrameResult process(const StereoFrame& recorded, AssociationTrace* trace = nullptr) override;

  /// Applies the loop corrections that are still being computed, and corrects all measured motions to the
  /// last estimate of the rectification, to first order.
  void finish() override;

  [[nodiscard]] CalibrationError calibration_error() const override {
    return right_camera_.calibration_error(settings_.calibration);
  }
  [[nodiscard]] RigSummary rig() const override { return right_camera_.summary(); }
  void begin_with_delay(const DelayEstimate& known) override { right_camera_.begin_with_delay(known); }
  [[nodiscard]] std::optional<InertialSummary> inertial() const override;
  [[nodiscard]] SavedMap saved_map() const override;

 private:
  /// What the pose of a tracked frame is measured against: with `--preset odometry` no landmarks correct it.
  [[nodiscard]] PoseBasis usual_basis() const {
    return settings_.system == SystemKind::kOdometry ? PoseBasis::kOdometry : PoseBasis::kLandmarks;
  }

  /// Whether the pose fits the landmarks that were found: either they gave it, or the odometry as usual.
  [[nodiscard]] bool fits_landmarks(const TrackedPose& tracked) const {
    return tracked.basis() == PoseBasis::kLandmarks || tracked.basis() == usual_basis();
  }

  // The steps of process(), and their parts.
  [[nodiscard]] TrackedPose track(const FrameImages& images, AssociationTrace* trace, StageClock& clock);
  [[nodiscard]] FrameMeasurement measure(const FrameImages& images, AssociationTrace* trace,
                                         StageClock& clock) const;
  [[nodiscard]] FrameMeasurement measure(const FrameImages& images, const RightImageState& right,
                                         const std::optional<DisplacementEstimate>& displacement,
                                         AssociationTrace* trace, StageClock& clock) const;
  void correct_last_exposure(const FrameImages& images);
  void find_first_displacement(const FrameImages& images);
  [[nodiscard]] std::vector<StereoPlane> points_of_previous() const;
  [[nodiscard]] RightImageState next_right_image(const FrameImages& images) const;
  [[nodiscard]] FrameMeasurement begin_measurement(
      const RightImageState& right, const std::optional<DisplacementEstimate>& displacement) const;
  [[nodiscard]] std::optional<DisplacementEstimate> displacement_in(const FrameImages& images,
                                                                    const RightImageState& right) const;
  void measure_motion(const FrameImages& images, FrameMeasurement& measured) const;
  void see_with_velocity(const FrameImages& images, FrameMeasurement& measured) const;
  void predict(std::int64_t stamp_ns, FrameMeasurement& measured) const;
  [[nodiscard]] std::optional<FrameMeasurement> without_imu(const FrameMeasurement& measured) const;
  [[nodiscard]] PoseGaussian predicted_pose(const PoseGaussian& T_previous_current) const;
  void find_landmarks(const FrameImages& images, FrameMeasurement& measured, AssociationTrace* trace) const;
  [[nodiscard]] RightImageFit searched_along_rows(const FrameImages& images, const RightImageState& right,
                                                  const std::vector<Match>& matches) const;
  [[nodiscard]] std::optional<DisplacementEstimate> displacement_of(const FrameImages& images,
                                                                    const FrameMeasurement& measured) const;
  [[nodiscard]] Matrix6<double> correct_displacement(FrameMeasurement& measured);
  [[nodiscard]] TrackedPose update(FrameMeasurement measured, std::int64_t stamp_ns);
  [[nodiscard]] bool jumps(const Pose& predicted, const PoseGaussian& measured, std::int64_t stamp_ns) const;
  [[nodiscard]] std::optional<PoseGaussian> relocalise(const FrameImages& images) const;
  void integrate(const TrackedPose& tracked, const FrameImages& images, FrameResult& result);
  [[nodiscard]] WeakReasons weaknesses(const TrackedPose& tracked, std::size_t frame);
  void note_static_points(const TrackedPose& tracked, const Pose& T_keyframe_previous);
  void complete(const FrameImages& images, FrameEvidence evidence, FrameResult& result);
  void prepare_next(const FrameImages& images, const std::vector<Match>& matches, const FrameResult& result);

  // The unusual cases: a repeated or missing image, and no map yet.
  [[nodiscard]] bool can_measure(const StereoFrame& frame) const;
  void pass_over(const StereoFrame& frame, FrameResult& result);
  void initialise(const FrameImages& images, FrameResult& result);

  [[nodiscard]] PoseGaussian measured_pose(const TrackedPose& tracked) const;
  [[nodiscard]] PoseGaussian reported(const TrackedPose& tracked) const;

  // The map and its keyframes.
  [[nodiscard]] bool uses_right_image() const {
    return !right_camera_.is_ignored() && reference_.has_stereo_depths();
  }
  bool extend_map(const TrackedPose& tracked, const FrameImages& images, Gap gap);
  bool extend_map_by_motion(const TrackedPose& tracked, const FrameImages& images);
  [[nodiscard]] bool gains_landmarks_by_motion(std::size_t frame, std::size_t matches) const;
  void add_corners(const std::vector<Match>& matches, const FrameImages& images);
  void change_keyframe_by_motion(const TrackedPose& tracked, const FrameImages& images);
  [[nodiscard]] bool needs_keyframe(std::size_t frame, std::size_t matches) const;
  void begin_after_loss(const FrameImages& images, const TrackedPose& tracked, Gap gap);
  void move_reference(std::size_t frame, PoseGaussian T_previous_keyframe, const KeyframeMotion& learned);
  void change_keyframe(const FrameImages& images, const PoseGaussian& T_previous_keyframe,
                       const std::vector<Match>& matches, const OdometryResult& odometry);
  void begin_keyframe(const FrameImages& images, std::vector<KeyframePoint> points);
  [[nodiscard]] std::vector<KeyframePoint> add_stereo_landmarks(const FrameImages& images,
                                                                const ReobservedLandmarks& reobserved = {});
  [[nodiscard]] std::vector<KeyframePoint> add_landmarks(const FrameImages& images,
                                                         const StereoPoints& points,
                                                         const ReobservedLandmarks& reobserved);

  Settings settings_;
  PoseGaussian posterior_;       // T_keyframe_camera of the last frame: the state of the filter
  ReferenceKeyframe reference_;  // image and points of the reference keyframe
  NoiseScale noise_;             // how much larger errors are than assumed, by the residuals of landmarks
  PointTracks tracks_;           // the points that the odometry follows
  MotionModel motion_;           // the motion that is expected of the next frame
  RightCamera right_camera_;     // rectification error, and whether right images fit
  PreviousFrame previous_;       // pyramids of the last measured frame, and whether it was lost
};

}  // namespace stereo_slam
