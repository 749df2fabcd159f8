// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/paper_slam.hpp"

#include <cstdint>
#include <optional>
#include <utility>

#include "stereo_slam/frontend/equal_brightness.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/slam/judgement.hpp"
#include "stereo_slam/slam/stage_clock.hpp"
#include "stereo_slam/tracking/associate.hpp"
#include "stereo_slam/tracking/landmark_search.hpp"
#include "stereo_slam/tracking/predict.hpp"
#include "stereo_slam/tracking/update.hpp"

namespace stereo_slam {

PaperSlam::PaperSlam(const StereoCamera& camera, const Settings& settings)
    : SlamSystem(camera, settings.map),
      camera_(camera),
      settings_(settings),
      posterior_(antipode::to_bingham_gaussian(certain_pose())) {}

FrameResult PaperSlam::process(const StereoFrame& recorded, AssociationTrace* trace) {
  FrameResult result{.index = recorded.index, .stamp_ns = recorded.stamp_ns};
  StageClock clock(result.times);
  const StereoFrame frame = with_equal_brightness(recorded);
  if (!frame.has_left() || !frame.has_right() || previous_.repeated_by(frame)) {
    pass_over(frame, result);
    return result;
  }
  FrameImages images = prepare_images(frame, PyramidSides::kBoth, previous_);
  images.features = extract_features(frame, settings_.features);
  clock.lap("images");
  FrameEvidence evidence{.after_loss = previous_.lost};
  std::vector<Match> matches;
  if (begun_) {
    const Step step = track(images, trace, clock);
    integrate(step, images, result);
    matches = step.tracked.matches;
    evidence.basis = step.tracked.basis();
  } else {
    begin(images, result);
    evidence.begins_map = begun_;
  }
  evidence.weak = result.weak;
  evidence.segment_predicted = path_.segment().predicted(path_.frames());
  result.status = judge(evidence);
  result.features = static_cast<int>(images.features.left.size());
  result.landmarks = static_cast<int>(local_map_.landmarks().size());
  clock.lap("map");
  prepare_next(images, matches, result);
  clock.lap("stereo");
  return result;
}

/// The pose of a frame: system input, prediction, data association, progressive update.
PaperSlam::Step PaperSlam::track(const FrameImages& images, AssociationTrace* trace,
                                 StageClock& clock) const {
  const std::int64_t stamp_ns = images.frame.stamp_ns;
  const ConsecutivePyramids pyramids{previous_.pyramids, images.flow_pyramids};
  OdometryResult odometry = odometry_from_circle(pyramids, odometry_points_, view_of(images.frame),
                                                 motion_.expected_until(stamp_ns), settings_);  // u_k, eq. 11
  clock.lap("odometry");
  const PoseGaussian motion =
      odometry.valid ? odometry.T_previous_current : motion_.guessed_until(stamp_ns, settings_.motion);
  const PoseDensity prior = predict_as_in_paper(posterior_, motion);  // eqs. 5-7
  clock.lap("predict");
  std::vector<Match> matches =
      find_landmarks(images, to_pose_gaussian(prior), odometry, trace);  // Alg. 3, sec. IV-C
  clock.lap("associate");
  const auto update =
      update_as_in_paper(prior, matches, local_map_.view(), settings_.update);  // eq. 13, Alg. 2
  clock.lap("update");
  return {update.posterior,
          {{.odometry = std::move(odometry), .prior = to_pose_gaussian(prior), .matches = std::move(matches)},
           {.posterior = to_pose_gaussian(update.posterior),
            .converged = update.converged,
            .nis = update.nis,
            .nis_dof = update.nis_dof}}};
}

/// The landmarks in the features of both images; in the left one without those that the odometry uses.
std::vector<Match> PaperSlam::find_landmarks(const FrameImages& images, const PoseGaussian& prior,
                                             const OdometryResult& odometry, AssociationTrace* trace) const {
  const MapView map = local_map_.view();
  const ConsecutivePyramids pyramids{previous_.pyramids, images.flow_pyramids};
  const Pose T_world_previous = posterior_.pose();
  const cv::Mat no_patches;
  const LandmarkSearch search{map, no_patches, pyramids, T_world_previous, {}, settings_};
  const StereoFeatures usable{exclude_features(images.features.left, positions(odometry.inliers),
                                               images.frame.left.size(), settings_.odometry.exclusion_px),
                              images.features.right};
  Association association = search.match_features(prior, usable);
  if (trace) *trace = trace_association(association, positions(odometry.inliers), settings_.association);
  return association.matches;
}

/// Makes the posterior the state, updates the landmarks, and drops and adds some. The matched landmarks are
/// static points of the next circular matching.
void PaperSlam::integrate(const Step& step, const FrameImages& images, FrameResult& result) {
  const TrackedPose& tracked = step.tracked;
  const bool by_odometry = tracked.basis() == PoseBasis::kOdometry;
  if (by_odometry && previous_.lost) {
    // Relative to a guess; no loop will tell its place.
    path_.segment().begin_next(path_.frames(), motion_.gap_until(images.frame.stamp_ns) == Gap::kShort);
  }
  result.weak = {.odometry_alone = by_odometry,
                 .few_landmarks = tracked.has_few_landmarks(),
                 .segment_not_localised = !path_.segment().localised()};
  if (found_again(tracked.basis(), previous_.lost)) {
    path_.trajectory().continue_odometry(tracked.prior.pose, tracked.update.posterior.pose);
  }
  motion_.learn(tracked, tracked.update.posterior, posterior_.pose(), previous_.lost, images.frame.stamp_ns);
  posterior_ = step.posterior;
  local_map_.record_observations(tracked.matches, images.features.left, images.frame.index);
  local_map_.update(tracked.matches, posterior_);  // Alg. 4
  odometry_points_.static_points.clear();
  if (tracked.basis() == PoseBasis::kLandmarks && !tracked.odometry.surprising) {
    for (const auto& match : tracked.matches) odometry_points_.static_points.push_back(match.z);
  }
  path_.append(tracked.update.posterior, tracked.measured(), calibration_error(), result);
  tracked.report(result);
  if (!tracked.measured()) return;
  local_map_.cull(images.frame.index);  // sec. IV-E
  (void)add_landmarks(images, positions(tracked.matches));
}

/// Adds landmarks at features with a stereo match, away from `reserved_px`. Returns the number of such
/// features.
std::size_t PaperSlam::add_landmarks(const FrameImages& images,
                                     const std::vector<Vector2<double>>& reserved_px) {
  const auto points =
      measure_stereo_points(view_of(images.frame), images.features.left, reserved_px, settings_);
  std::vector<std::uint32_t> ids;
  for (std::size_t i = 0; i < points.measured.size(); ++i) ids.push_back(local_map_.new_id());
  local_map_.add(points, ids, to_pose_gaussian(posterior_), images.frame);
  return ids.size();
}

/// Chooses the points of the next frame's circular matching: those with a stereo match, away from the
/// landmarks.
void PaperSlam::prepare_next(const FrameImages& images, const std::vector<Match>& matches,
                             const FrameResult& result) {
  auto landmarks_px = positions(matches);  // also those that were culled
  for (const auto& px : local_map_.observed_in(images.frame.index)) landmarks_px.push_back(px);
  odometry_points_.points =
      select_odometry_points(view_of(images.frame), images.features.left, landmarks_px, settings_);
  previous_.replace(images.pyramids, path_.frames(), result.status == TrackingStatus::kLost);
}

/// Begins the map, if the images show enough for one.
void PaperSlam::begin(const FrameImages& images, FrameResult& result) {
  path_.trajectory().begin(images.frame.index);
  local_map_.restart(0);
  odometry_points_ = {};
  begun_ = add_landmarks(images, {}) >= static_cast<std::size_t>(settings_.update.min_matches);
  if (!begun_) return path_.append_unknown(calibration_error(), result);
  motion_.begin_map(images.frame.stamp_ns);
  path_.append(to_pose_gaussian(posterior_), true, calibration_error(), result);
  result.is_keyframe = true;
}

/// A repeated image measures nothing, and neither does one that is not there: the pose is predicted.
void PaperSlam::pass_over(const StereoFrame& frame, FrameResult& result) {
  if (!begun_) return path_.append_unknown(calibration_error(), result);
  const bool repeated = frame.has_left() && frame.has_right();
  const bool waits = repeated && previous_.is_last_of(path_.frames()) && !previous_.lost;
  result.weak = {.repeated_image = repeated,
                 .right_image_unfit = !frame.has_right(),
                 .segment_not_localised = !path_.segment().localised()};
  result.status = judge({.waits = waits, .weak = result.weak});
  const PoseDensity predicted =
      predict_as_in_paper(posterior_, motion_.guessed_until(frame.stamp_ns, settings_.motion));
  path_.append(to_pose_gaussian(predicted), false, calibration_error(), result);
}

}  // namespace stereo_slam
