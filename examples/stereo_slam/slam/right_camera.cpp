// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/right_camera.hpp"

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/tracking/rectification_constraints.hpp"

namespace stereo_slam {

RightCamera RightCamera::resumed(const StereoCamera& camera, const OnlineRectificationSettings& settings,
                                 const RectificationEstimate& learned) {
  RightCamera right(camera, settings);
  right.rectification_ = RectificationEstimator::after_drift(camera, settings, learned);
  return right;
}

void RightCamera::take(const RightImageState& image, const std::optional<DisplacementEstimate>& left) {
  image_ = image;
  const bool vibrated = vibration_.present();
  if (!image.displacement.isZero(0.0) && !vibrated) vibration_.begin();
  if (left) vibration_.add(image.displacement + left->change);
  if (!vibrated && vibration_.present()) rectification_.forget_disparity_offset(image.displacement.norm());
}

bool RightCamera::refuse_learned() {
  if (!rectification_.contradicts_learned()) return false;
  rectification_ = RectificationEstimator(camera_, settings_);
  refused_learned_ = true;
  return true;
}

bool RightCamera::relearn_rows(const StereoFrame& frame) {
  return settings_.enabled && rectification_.relearn_rows(match_corners(frame.left, frame.right));
}

bool RightCamera::end_frame(const StereoFrame& frame, bool unmeasured) {
  unmeasured_frames_ = unmeasured ? unmeasured_frames_ + 1 : 0;
  if (unmeasured_frames_ % kRelearnInterval != kFirstRelearn || !relearn_rows(frame)) return false;
  image_.monitor.distrust();
  return true;
}

RectificationEffect RightCamera::consider(const std::vector<Match>& matches, const MapView& map,
                                          const Pose& T_keyframe_camera) {
  came_to_rest_ = false;
  if (!settings_.enabled) return {};
  return rectification_.consider_motion(bias_constraints(matches, map, T_keyframe_camera), T_keyframe_camera);
}

RectificationEffect RightCamera::refine(const std::vector<Match>& matches, const MapView& map,
                                        const Pose& T_keyframe_camera, const OdometryResult& odometry) {
  came_to_rest_ = false;
  if (!settings_.enabled) return {};
  const auto constraints = bias_constraints(matches, map, T_keyframe_camera);
  RectificationEffect effect =
      vibration_.present()
          ? rectification_.add_motion_of_vibrating_rig(constraints, T_keyframe_camera, image_.covariance)
          : rectification_.add_motion(constraints, T_keyframe_camera);
  if (effect.derivative.isZero(0.0)) {
    const Pose& T_previous_current = odometry.T_previous_current.pose;
    effect = rectification_.consider_motion(bias_constraints(odometry.inliers, T_previous_current, camera_),
                                            T_previous_current);
    effect.vibrates = vibration_.present();
  }
  if (const auto rest = vibration_.rest()) {
    rectification_.shift(*rest);
    image_.displacement -= *rest;
    vibration_ = {};
    came_to_rest_ = true;
  }
  rectification_.advance();
  if (rectification_.noticed_turn()) image_.monitor.distrust();
  return effect;
}

}  // namespace stereo_slam
