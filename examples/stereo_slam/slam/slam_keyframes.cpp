// SPDX-License-Identifier: MIT
// The part of the SLAM that adds keyframes and landmarks.
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/slam/slam.hpp"

namespace stereo_slam {

/// Takes a keyframe or begins a map segment if it is time to, and otherwise drops old landmarks. Returns
/// whether the frame became a keyframe.
bool Slam::extend_map(const TrackedPose& tracked, const FrameImages& images) {
  if (right_camera_.is_ignored()) {
    local_map_.cull(images.frame.index);
    return false;
  }
  if (tracked.basis == PoseBasis::kOdometry && previous_.lost) {
    begin_segment(images, tracked);
    return true;
  }
  const bool recognised = tracked.basis == PoseBasis::kKeyframe;
  if (!recognised && !needs_keyframe(images.frame.index, tracked.matches.size())) {
    local_map_.cull(images.frame.index);  // at the end: the matches refer to the list of landmarks
    return false;
  }
  if (recognised) reference_.scene = {};
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
         frame >= path_.trajectory().reference_frame() + static_cast<std::size_t>(rule.max_frames);
}

/// Begins a map segment at this frame, whose pose relative to the last keyframe is a guess. The pose of the
/// previous frame was a guess too; the odometry now measures it relative to this frame.
void Slam::begin_segment(const FrameImages& images, const TrackedPose& tracked) {
  path_.begin_segment();
  reference_.scene = {};
  change_keyframe(images, reported(tracked), {}, {});
  path_.replace(previous_.position, antipode::inverse(tracked.odometry.T_previous_current));
}

/// Makes the current frame the reference keyframe of pose and landmarks, and refines the rectification by the
/// matches with the last one.
void Slam::change_keyframe(const FrameImages& images, PoseGaussian T_previous_keyframe,
                           const std::vector<Match>& matches, const OdometryResult& odometry) {
  const RectificationResidual before = right_camera_.geometry();
  const RectificationEffect effect =
      right_camera_.refine(matches, local_map_.view(), posterior_.pose(), odometry);
  if (right_camera_.learns()) tracks_.remeasure(before, right_camera_.geometry());
  T_previous_keyframe.covariance += effect.covariance;
  path_.add_keyframe(images.frame.index, T_previous_keyframe, effect);
  posterior_ = certain_pose();
  const ReobservedLandmarks reobserved(matches, local_map_.landmarks());
  local_map_.restart(path_.trajectory().reference());
  begin_keyframe(images, add_landmarks(images, reobserved));
}

void Slam::begin_keyframe(const FrameImages& images, std::vector<KeyframePoint> points) {
  const StereoFrame& frame = images.frame;
  reference_.left = frame.left.clone();
  reference_.landmarks = local_map_.landmarks().size();
  reference_.keyframe = {};
  reference_.keyframe.frame = frame.index;
  reference_.keyframe.stamp_ns = frame.stamp_ns;
  reference_.keyframe.segment = path_.segment().current();
  reference_.keyframe.points = std::move(points);
  reference_.keyframe.T_previous_keyframe = path_.trajectory().T_previous_reference();
  path_.search_loops(reference_.keyframe, reference_.left, right_camera_.geometry().lens());
}

/// Adds landmarks at corners with a stereo match; a corner at a re-observed landmark keeps its id. Returns
/// all these corners, also those that became no landmark.
std::vector<KeyframePoint> Slam::add_landmarks(const FrameImages& images,
                                               const ReobservedLandmarks& reobserved) {
  const StereoFrame& frame = images.frame;
  const auto points = measure_stereo_corners(right_camera_.view_of(frame), images.corners, settings_);
  std::vector<std::uint32_t> ids;
  for (const auto& known : reobserved.ids_at(points, frame.left.size())) {
    ids.push_back(known ? *known : local_map_.new_id());
  }
  local_map_.add(points, ids, to_pose_gaussian(posterior_), frame);
  right_camera_.add_rows(points.measured);
  return keyframe_points(points, ids);
}

}  // namespace stereo_slam
