// SPDX-License-Identifier: MIT
// The part of the SLAM that adds keyframes and landmarks.
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/tracking/rig_constraints.hpp"

namespace stereo_slam {
namespace {

[[nodiscard]] double median_disparity(const std::vector<Match>& matches) {
  std::vector<double> disparities_px;
  disparities_px.reserve(matches.size());
  for (const auto& match : matches) disparities_px.push_back(match.predicted.z.z());
  return median(disparities_px);
}

}  // namespace

/// Takes a keyframe or begins a map segment if it is time to, and otherwise drops old landmarks. Returns
/// whether the frame became a keyframe. `gap` are the frames before this one without a measured motion.
bool Slam::extend_map(const TrackedPose& tracked, const FrameImages& images, Gap gap) {
  if (right_camera_.is_ignored()) return extend_map_by_motion(tracked, images);
  if (tracked.basis() == PoseBasis::kOdometry && previous_.lost) {
    begin_after_loss(images, tracked, gap);
    return true;
  }
  const bool recognised = tracked.basis() == PoseBasis::kKeyframe;
  if (!recognised && !needs_keyframe(images.frame.index, tracked.matches.size())) {
    local_map_.cull(images.frame.index);  // at the end: the matches refer to the list of landmarks
    return false;
  }
  if (recognised) reference_.scene = {};
  // Not with a recognised keyframe: its matches were searched at the predicted pose.
  const auto matches = fits_landmarks(tracked) ? tracked.matches : std::vector<Match>{};
  const bool alone = tracked.basis() == PoseBasis::kOdometry;
  change_keyframe(images, reported(tracked), matches, alone ? tracked.odometry : OdometryResult{});
  return true;
}

bool Slam::needs_keyframe(std::size_t frame, std::size_t matches) const {
  const auto& rule = settings_.keyframes;
  const bool right_image_is_back = !right_camera_.is_ignored() && reference_.scale_sigma > 0.0;
  return right_image_is_back ||
         static_cast<double>(matches) < rule.min_match_ratio * static_cast<double>(reference_.landmarks) ||
         matches < static_cast<std::size_t>(rule.min_matches) ||
         frame >= path_.trajectory().reference_frame() + static_cast<std::size_t>(rule.max_frames);
}

/// As extend_map() for a frame whose right image is not used: the depths of landmarks are those that the map
/// has, or the motion of the left camera tells them. A keyframe is taken if it gains landmarks.
bool Slam::extend_map_by_motion(const TrackedPose& tracked, const FrameImages& images) {
  const bool measured = tracked.basis() == PoseBasis::kLandmarks;
  if (measured && gains_landmarks_by_motion(images.frame.index, tracked.matches.size())) {
    change_keyframe_by_motion(tracked, images);
    return true;
  }
  if (measured) add_corners(tracked.matches, images);
  local_map_.cull(images.frame.index);
  return false;
}

/// Whether the depths of enough corners are known by now: as many as the usual keyframe replaces, or, when a
/// keyframe is due as usual, a third of the fewest landmarks.
bool Slam::gains_landmarks_by_motion(std::size_t frame, std::size_t matches) const {
  const auto& rule = settings_.keyframes;
  const std::size_t known = reference_.motion_stereo.known();
  const bool due = needs_keyframe(frame, matches) && 3 * known >= static_cast<std::size_t>(rule.min_matches);
  return due || static_cast<double>(matches) < rule.min_match_ratio * static_cast<double>(matches + known);
}

/// Begins to follow corners beside the landmarks, if few are followed.
void Slam::add_corners(const std::vector<Match>& matches, const FrameImages& images) {
  const auto most = static_cast<std::size_t>(settings_.map.max_new_landmarks);
  auto present_px = positions(matches);
  for (const auto& px : reference_.motion_stereo.positions()) present_px.push_back(px);
  if (4 * present_px.size() > 3 * most) return;
  reference_.motion_stereo.add(images.frame.left, posterior_.pose,
                               find_landmark_corners(images.frame.left, present_px, settings_),
                               median_disparity(matches));
}

/// As change_keyframe(), without a right image. The scale of the new landmarks has the error of the motion in
/// addition to that of the landmarks before. Both are added as if they were the same, since links are
/// composed as if they were independent.
void Slam::change_keyframe_by_motion(const TrackedPose& tracked, const FrameImages& images) {
  const KeyframeMotion learned =
      right_camera_.consider(seen_motion(tracked.matches, local_map_.view(), posterior_.pose));
  const PoseGaussian T_keyframe_current = measured_pose(tracked);
  MotionStereo corners = std::move(reference_.motion_stereo);
  const auto seen = corners.measure(images.frame.left, tracked.matches, local_map_.view(), T_keyframe_current,
                                    learned.by_lens, right_camera_.left_camera());
  corners.change_keyframe(T_keyframe_current);
  const ReobservedLandmarks reobserved(tracked.matches, local_map_.landmarks());
  move_reference(images.frame.index, reported(tracked), learned);
  const double scale_sigma = reference_.scale_sigma + seen.scale_sigma;
  begin_keyframe(images, add_landmarks(images, seen, reobserved));
  reference_.scale_sigma = scale_sigma;
  reference_.motion_stereo = std::move(corners);
}

/// Makes a frame the reference of pose and landmarks, of which there are none yet. `learned` is what its pose
/// has to do with the rig.
void Slam::move_reference(std::size_t frame, PoseGaussian T_previous_keyframe,
                          const KeyframeMotion& learned) {
  T_previous_keyframe.covariance += learned.covariance;
  motion_.inertial().remeasure(learned.change);
  path_.trajectory().add_keyframe(frame, motion_.inertial().change_keyframe(T_previous_keyframe));
  posterior_ = certain_pose();
  local_map_.restart(path_.trajectory().reference());
}

/// Begins anew at this frame, whose pose relative to the last keyframe is a guess: with a map segment, unless
/// the first motion of the run tells what it was before. The pose of the previous frame was a guess too; the
/// odometry now measures it relative to this frame.
void Slam::begin_after_loss(const FrameImages& images, const TrackedPose& tracked, Gap gap) {
  if (gap != Gap::kStart) path_.segment().begin_next(path_.frames(), gap == Gap::kShort);
  reference_.scene = {};
  change_keyframe(images, reported(tracked), {}, {});
  path_.trajectory().replace(previous_.position, antipode::inverse(tracked.odometry.T_previous_current));
}

/// Makes the current frame the reference keyframe of pose and landmarks, and refines the rectification by the
/// matches with the last one.
void Slam::change_keyframe(const FrameImages& images, const PoseGaussian& T_previous_keyframe,
                           const std::vector<Match>& matches, const OdometryResult& odometry) {
  const SeenMotion motion = seen_motion(matches, local_map_.view(), posterior_.pose);
  // Depths by motion teach nothing of the disparities.
  const KeyframeMotion learned =
      reference_.scale_sigma > 0.0
          ? right_camera_.consider(motion)
          : right_camera_.refine(motion, seen_motion(odometry.inliers, odometry.T_previous_current.pose,
                                                     right_camera_.camera()));
  if (right_camera_.learns()) tracks_.remeasure(learned.remeasurement);
  const ReobservedLandmarks reobserved(matches, local_map_.landmarks());
  move_reference(images.frame.index, T_previous_keyframe, learned);
  begin_keyframe(images, add_stereo_landmarks(images, reobserved));
}

void Slam::begin_keyframe(const FrameImages& images, std::vector<KeyframePoint> points) {
  const StereoFrame& frame = images.frame;
  reference_.left = frame.left.clone();
  reference_.landmarks = local_map_.landmarks().size();
  reference_.scale_sigma = 0.0;
  reference_.motion_stereo = {};
  reference_.keyframe = {};
  reference_.keyframe.frame = frame.index;
  reference_.keyframe.stamp_ns = frame.stamp_ns;
  reference_.keyframe.segment = path_.segment().current();
  reference_.keyframe.points = std::move(points);
  reference_.keyframe.T_previous_keyframe = path_.trajectory().T_previous_reference();
  reference_.keyframe.tilt = path_.trajectory().tilt_of_reference();
  path_.search_loops(reference_.keyframe, reference_.left, right_camera_.lens());
}

/// Adds landmarks at corners with a stereo match. Returns these corners as add_landmarks() does.
std::vector<KeyframePoint> Slam::add_stereo_landmarks(const FrameImages& images,
                                                      const ReobservedLandmarks& reobserved) {
  const auto points = measure_stereo_corners(right_camera_.view_of(images.frame), settings_);
  right_camera_.add_rows(points.measured);
  return add_landmarks(images, points, reobserved);
}

/// Adds landmarks; a point at a re-observed landmark keeps its id. Returns all points, also those that became
/// no landmark.
std::vector<KeyframePoint> Slam::add_landmarks(const FrameImages& images, const StereoPoints& points,
                                               const ReobservedLandmarks& reobserved) {
  std::vector<std::uint32_t> ids;
  for (const auto& known : reobserved.ids_at(points, images.frame.left.size())) {
    ids.push_back(known ? *known : local_map_.new_id());
  }
  local_map_.add(points, ids, posterior_, images.frame);
  return keyframe_points(points, ids);
}

}  // namespace stereo_slam
