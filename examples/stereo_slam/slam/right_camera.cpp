// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/right_camera.hpp"

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/tracking/rectification_constraints.hpp"

namespace stereo_slam {

RightCamera RightCamera::resumed(const StereoCamera& camera, const OnlineRectificationSettings& settings,
                                 const RectificationEstimate& learned) {
  RightCamera right(camera, settings);
  right.rectification_ = RectificationEstimator::resumed(camera, settings, learned);
  return right;
}

bool RightCamera::relearn_rows(const StereoFrame& frame) {
  return learns_ && rectification_.relearn_rows(match_corners(frame.left, frame.right));
}

bool RightCamera::end_frame(const StereoFrame& frame, bool unmeasured) {
  unmeasured_frames_ = unmeasured ? unmeasured_frames_ + 1 : 0;
  if (unmeasured_frames_ % kRelearnInterval != kFirstRelearn || !relearn_rows(frame)) return false;
  monitor_.distrust();
  return true;
}

RectificationEffect RightCamera::refine(const std::vector<Match>& matches, const MapView& map,
                                        const Pose& T_keyframe_camera, const OdometryResult& odometry) {
  if (!learns_) return {};
  RectificationEffect effect =
      rectification_.add_motion(bias_constraints(matches, map, T_keyframe_camera), T_keyframe_camera);
  if (effect.derivative.isZero(0.0)) {
    const Pose& T_previous_current = odometry.T_previous_current.pose;
    effect = rectification_.consider_motion(bias_constraints(odometry.inliers, T_previous_current, camera_),
                                            T_previous_current);
  }
  rectification_.advance();
  if (rectification_.noticed_turn()) monitor_.distrust();
  return effect;
}

}  // namespace stereo_slam
