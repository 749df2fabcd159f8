// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/odometry/odometry.hpp"
#include "stereo_slam/rig/calibration_error.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/slam/frame_images.hpp"
#include "stereo_slam/slam/motion_model.hpp"
#include "stereo_slam/slam/slam_system.hpp"
#include "stereo_slam/slam/stage_clock.hpp"
#include "stereo_slam/slam/tracked_pose.hpp"

namespace stereo_slam {

/// The filter of the DQV-SLAM paper, without its loop closing (`--preset paper`), for comparison:
/// docs/papers.md lists the differences.
///
/// One map in the frame of the first camera. The pose has a Bingham density, orientation and translation
/// independent; Alg. 2 updates it with 7 x 7 points, by subsets of the matches. ORB features measure the
/// landmarks, which Alg. 4 updates in every frame. There are no keyframes and no loops, and no
/// errors of the calibration are estimated.
class PaperSlam final : public SlamSystem {
 public:
  PaperSlam(const StereoCamera& camera, const Settings& settings);

  FrameResult process(const StereoFrame& recorded, AssociationTrace* trace = nullptr) override;

  [[nodiscard]] CalibrationError calibration_error() const override {
    return allowed_calibration_error(settings_.calibration, camera_);
  }

 private:
  [[nodiscard]] StereoView view_of(const StereoFrame& frame) const {
    return StereoView::exact(frame, camera_);
  }

  // The boxes of Fig. 2.
  /// A step of the filter, with its posterior as it is.
  struct Step {
    PoseDensity posterior;
    TrackedPose tracked;
  };
  [[nodiscard]] Step track(const FrameImages& images, AssociationTrace* trace, StageClock& clock) const;
  [[nodiscard]] std::vector<Match> find_landmarks(const FrameImages& images, const PoseGaussian& prior,
                                                  const OdometryResult& odometry,
                                                  AssociationTrace* trace) const;
  void integrate(const Step& step, const FrameImages& images, FrameResult& result);
  [[nodiscard]] std::size_t add_landmarks(const FrameImages& images,
                                          const std::vector<Vector2<double>>& reserved_px);
  void prepare_next(const FrameImages& images, const std::vector<Match>& matches, const FrameResult& result);

  void begin(const FrameImages& images, FrameResult& result);
  void pass_over(const StereoFrame& frame, FrameResult& result);

  StereoCamera camera_;
  Settings settings_;
  // The local map of the base has all landmarks, in the world.
  PoseDensity posterior_;           // T_world_camera of the last frame
  OdometryPoints odometry_points_;  // where circular matching starts
  MotionModel motion_;              // what the odometry expects
  PreviousFrame previous_;          // what the next frame is tracked from
  bool begun_ = false;              // there is a map
};

}  // namespace stereo_slam
