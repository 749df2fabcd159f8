// SPDX-License-Identifier: MIT
// The part of the SLAM that adds keyframes and landmarks.
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/tracking/rectification_constraints.hpp"

namespace stereo_slam {

/// Removes old landmarks, and adds new ones where it is time to. Returns whether the frame became a keyframe.
bool Slam::extend_map(const TrackedPose& tracked, const FrameImages& images) {
  if (!anchored()) {
    local_map_.cull(images.frame.index);
    (void)add_landmarks(images, positions(tracked.matches));
    return false;
  }
  if (ignores_right_image()) {
    local_map_.cull(images.frame.index);
    return false;
  }
  if (tracked.basis == PoseBasis::kOdometry && previous_.lost) {
    begin_segment(images, tracked);
    return true;
  }
  const bool recognised = tracked.basis == PoseBasis::kKeyframe;
  if (!recognised && !needs_keyframe(images.frame.index, tracked.matches.size())) {
    local_map_.cull(images.frame.index);  // not before: the matches refer to the list of landmarks
    return false;
  }
  if (recognised) scene_ = {};
  // Not with a recognised keyframe: its matches were searched at the predicted pose.
  const auto matches = fits_landmarks(tracked) ? tracked.matches : std::vector<Match>{};
  const bool alone = tracked.basis == PoseBasis::kOdometry;
  change_keyframe(images, reported(tracked), matches, alone ? tracked.odometry : OdometryResult{});
  return true;
}

bool Slam::needs_keyframe(std::size_t frame, std::size_t matches) const {
  const auto& rule = settings_.keyframes;
  return static_cast<double>(matches) < rule.min_match_ratio * static_cast<double>(reference_.landmarks) ||
         matches < static_cast<std::size_t>(rule.min_matches) ||
         frame >= trajectory_.reference_frame() + static_cast<std::size_t>(rule.max_frames);
}

/// Begins a map segment at this frame, whose pose relative to the last keyframe is a guess. The pose of the
/// previous frame was a guess too; the odometry now measures it relative to this frame.
void Slam::begin_segment(const FrameImages& images, const TrackedPose& tracked) {
  segment_.begin_next();
  scene_ = {};
  change_keyframe(images, reported(tracked), {}, {});
  trajectory_.replace(previous_.position, antipode::inverse(tracked.odometry.T_previous_current));
}

/// Makes the current camera the reference of pose and landmarks.
void Slam::change_keyframe(const FrameImages& images, PoseGaussian T_previous_keyframe,
                           const std::vector<Match>& matches, const OdometryResult& odometry) {
  const RectificationEffect effect = refine_rectification(matches, odometry);
  T_previous_keyframe.covariance += effect.covariance;
  trajectory_.add_keyframe(images.frame.index, T_previous_keyframe, effect);
  posterior_ = certain_pose();
  const ReobservedLandmarks reobserved(matches, local_map_.landmarks());
  local_map_.restart(trajectory_.reference());
  begin_keyframe(images, add_landmarks(images, {}, reobserved));
}

void Slam::begin_keyframe(const FrameImages& images, std::vector<KeyframePoint> points) {
  const StereoFrame& frame = images.frame;
  reference_.left = frame.left.clone();
  reference_.landmarks = local_map_.landmarks().size();
  reference_.keyframe = {};
  reference_.keyframe.frame = frame.index;
  reference_.keyframe.stamp_ns = frame.stamp_ns;
  reference_.keyframe.segment = segment_.current();
  reference_.keyframe.points = std::move(points);
  reference_.keyframe.T_previous_keyframe = trajectory_.T_previous_reference();
  if (!loops_) return;
  loops_->add_keyframe(reference_.keyframe, frontend_->describes_points() ? cv::Mat() : reference_.left,
                       segment_.localised() ? CorrectionDelay::kUsual : CorrectionDelay::kShort);
}

/// Adds landmarks at features with a stereo match, away from `reserved_px`; a feature at a re-observed
/// landmark keeps its id. Returns what they were made from.
std::vector<KeyframePoint> Slam::add_landmarks(const FrameImages& images,
                                               const std::vector<Vector2<double>>& reserved_px,
                                               const ReobservedLandmarks& reobserved) {
  const StereoFrame& frame = images.frame;
  const auto points = frontend_->measure_points(images, view_of(frame), reserved_px);
  std::vector<std::uint32_t> ids;
  for (const auto& known : reobserved.ids_at(points, frame.left.size())) {
    ids.push_back(known ? *known : local_map_.new_id());
  }
  local_map_.add(points, ids, to_pose_gaussian(posterior_), frame);
  if (settings_.online_rectification.enabled) rectification_.add_rows(points.measured);
  return keyframe_points(points, ids);
}

/// Learns the row offset anew from a pair in which hardly any stereo match is found, or none was searched
/// yet.
bool Slam::relearn_rows(const StereoFrame& frame) {
  if (!settings_.online_rectification.enabled) return false;
  return rectification_.relearn_rows(match_corners(frame.left, frame.right));
}

/// Refines the rectification by the landmarks of the last keyframe that were matched in this frame. Returns
/// how the frame's pose depends on the rectification. If the landmarks do not tell, points of the odometry
/// do, which are given if it alone measured the motion. They are followed over one frame only, so they do not
/// refine it.
RectificationEffect Slam::refine_rectification(const std::vector<Match>& matches,
                                               const OdometryResult& odometry) {
  if (!settings_.online_rectification.enabled || !settings_.refinement.enabled) return {};
  const RectificationResidual before = rectification_.current();
  const Pose T_keyframe_camera = posterior_.pose();
  RectificationEffect effect = rectification_.add_motion(
      bias_constraints(matches, local_map_.view(), T_keyframe_camera), T_keyframe_camera);
  if (effect.derivative.isZero(0.0)) {
    const Pose& T_previous_current = odometry.T_previous_current.pose;
    effect = rectification_.consider_motion(bias_constraints(odometry.inliers, T_previous_current, camera_),
                                            T_previous_current);
  }
  rectification_.advance();
  if (rectification_.noticed_turn()) right_image_.distrust();
  frontend_->change_rectification(before, rectification_.current());
  return effect;
}

}  // namespace stereo_slam
