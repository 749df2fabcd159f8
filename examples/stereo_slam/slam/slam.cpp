// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/slam.hpp"

#include <stdexcept>
#include <utility>

#include "stereo_slam/frontend/equal_brightness.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/tracking/association_trace.hpp"
#include "stereo_slam/tracking/landmark_search.hpp"
#include "stereo_slam/tracking/predict.hpp"
#include "stereo_slam/tracking/update.hpp"

namespace stereo_slam {
namespace {

[[nodiscard]] FrameResult empty_result(const StereoFrame& frame) {
  FrameResult result;
  result.index = frame.index;
  result.stamp_ns = frame.stamp_ns;
  return result;
}

}  // namespace

Slam::Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread)
    : Slam(camera, settings, loop_thread, SavedMap{}, MapUse::kContinue) {}

Slam::Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread,
           const SavedMap& loaded, MapUse use)
    : camera_(camera),
      settings_(settings),
      frontend_(anchored() && settings.refinement.enabled ? make_patch_frontend(camera, settings)
                                                          : make_feature_frontend(settings)),
      posterior_(certain_pose()),
      local_map_(camera, settings.map),
      rectification_(camera, settings.online_rectification),
      noise_(expected_variance_ratio(settings.update)) {
  // The global layout has one keyframe only, and so nothing that a loop could move.
  if (settings.loop_closure.enabled && anchored()) loops_.emplace(camera, settings, loop_thread, loaded, use);
  if (loaded.keyframes.empty()) return;
  if (!loops_) {
    throw std::invalid_argument("a run is localised in a loaded map by loop closure; enable loop_closure");
  }
  check_camera_of(loaded, camera);
  rectification_ =
      RectificationEstimator::resumed(camera, settings.online_rectification, loaded.rectification);
  global_map_ = GlobalMap(loaded);
  segment_ = SegmentState::in_loaded_map();
}

FrameResult Slam::process(const StereoFrame& recorded, AssociationTrace* trace) {
  StageClock clock;
  FrameResult result = empty_result(recorded);
  if (loops_) result.loop_corrected = apply(loops_->correction_due(recorded.index));
  if (loops_) clock.lap("loops");
  const StereoFrame frame = with_equal_brightness(recorded);
  if (!can_measure(frame) || previous_.repeated_by(frame)) {
    pass_over(frame, result, clock);
    return result;
  }
  const FrameImages images = frontend_->prepare(frame, previous_);
  clock.lap("images");

  std::vector<Match> matches;
  FrameEvidence evidence{.after_loss = previous_.lost};
  if (started_) {
    const auto odometry = measure_motion(images);  // u_k, eq. 11
    clock.lap("odometry");
    const auto prior = predict(odometry, frame.stamp_ns);  // eqs. 5-7
    clock.lap("predict");
    matches = find_landmarks(images, prior, odometry, trace);  // Alg. 3, sec. IV-C
    clock.lap("associate");
    auto tracked = update(prior, odometry, matches);  // eq. 13, Alg. 2
    clock.lap("update");
    if (anchored() && !ignores_right_image() && (previous_.lost || !tracked.measured())) {
      tracked.use_keyframe(relocalise(images, tracked.prior));
      clock.lap("recognise");
    }
    integrate(tracked, images, result);  // trajectory, Alg. 4, keyframes
    evidence.basis = tracked.basis;
  } else {
    initialise(images, result);
    evidence.begins_map = started_;
  }
  complete(images, evidence, result);
  clock.lap("map");
  const bool unmeasured = result.status == TrackingStatus::kLost || !result.right_image_fits;
  frames_without_right_ = unmeasured ? frames_without_right_ + 1 : 0;
  if (started_ && frames_without_right_ % kRelearnInterval == 2 && relearn_rows(frame)) {
    result.weak.right_camera_turned = true;
    right_image_.distrust();
  }
  prepare_next(images, matches, result);
  clock.lap("stereo");
  result.times = clock.times();
  return result;
}

/// Moves the keyframes. The state of the filter is relative to the last one and stays as it is.
bool Slam::apply(const std::optional<LoopCorrection>& correction) {
  if (!correction) return false;
  segment_.correct(correction->segment_localised);
  trajectory_.correct(correction->T_world_keyframe);
  global_map_.correct(*correction);
  return true;
}

OdometryResult Slam::measure_motion(const FrameImages& images) {
  const ConsecutivePyramids pyramids{previous_.pyramids, images.flow_pyramids};
  ExpectedMotion expected{velocity_.motion_until(images.frame.stamp_ns), Expectation::kNoMotion};
  if (velocity_.known()) {
    expected.expectation = jerks_.steady() ? Expectation::kSteady : Expectation::kDoubtful;
  }
  OdometryResult odometry = frontend_->measure_motion(pyramids, view_of(images.frame), expected);
  right_image_.begin_frame(images.frame.has_right());
  right_image_.add(odometry.right_image);
  if (!ignores_right_image()) return odometry;
  OdometryResult unmeasured;
  unmeasured.T_previous_current.pose = expected.T_previous_current;
  return unmeasured;
}

PoseDensity Slam::predict(const OdometryResult& odometry, std::int64_t stamp_ns) {
  if (tracks_correlation()) local_map_.predict_correlation(odometry.T_previous_current.pose);
  return predict_pose(posterior_, odometry.T_previous_current, odometry.valid, settings_,
                      velocity_.unseen_until(stamp_ns));
}

std::vector<Match> Slam::find_landmarks(const FrameImages& images, const PoseDensity& prior,
                                        const OdometryResult& odometry, AssociationTrace* trace) {
  const PoseGaussian expected = to_pose_gaussian(prior);
  const MapView map = local_map_.view();
  const ConsecutivePyramids pyramids{previous_.pyramids, images.flow_pyramids};
  const Pose T_keyframe_previous = posterior_.pose();
  const LandmarkSearch search(map, reference_.left, pyramids, T_keyframe_previous, settings_);
  const auto find = [&] {
    return frontend_->find_landmarks(search, expected, images, view_of(images.frame), odometry);
  };
  Association association = find();
  if (!previous_.lost) {  // else the landmarks may be those of another place, which no image shows
    right_image_.add(association.right_image);
    const bool searched_right = association.right_image.in_left > 0;
    if (searched_right && ignores_right_image()) association = find();
  }
  if (trace) {
    if (association.flow.empty()) search.observe(association);
    *trace = trace_association(association, positions(odometry.inliers), settings_.association);
  }
  return association.matches;
}

TrackedPose Slam::update(const PoseDensity& prior, const OdometryResult& odometry,
                         std::vector<Match> matches) {
  auto update = update_pose(prior, matches, local_map_.view(), settings_.update);
  if (ignores_right_image() && jumps(prior.pose(), update.posterior.pose())) {
    update = {.posterior = prior};
  }
  if (tracks_correlation()) {
    local_map_.update_correlation(to_pose_gaussian(prior), update.posterior.pose(), update.used);
  }
  PoseBasis basis = PoseBasis::kNothing;
  if (odometry.valid) basis = PoseBasis::kOdometry;
  if (update.converged) basis = PoseBasis::kLandmarks;
  return {.prior = prior,
          .posterior = update.posterior,
          .basis = basis,
          .odometry = odometry,
          .matches = std::move(matches),
          .nis = update.nis,
          .nis_dof = update.nis_dof - (ignores_right_image() ? static_cast<int>(update.used.size()) : 0),
          .variance_ratio = update.variance_ratio};
}

/// Whether a measured position is half a baseline or more from the predicted one. If one camera's images are
/// ignored, this may be because those of the two were swapped, or those of the other one are late.
bool Slam::jumps(const Pose& predicted, const Pose& measured) const {
  return (measured.translation() - predicted.translation()).norm() > 0.5 * camera_.baseline_m;
}

void Slam::integrate(const TrackedPose& tracked, const FrameImages& images, FrameResult& result) {
  constexpr std::size_t kFewMatches = 15;  // so few may agree by chance, as in images blurred by motion
  const bool by_landmarks = tracked.basis == PoseBasis::kLandmarks;
  result.weak = {
      .odometry_alone = tracked.basis == PoseBasis::kOdometry && (previous_.lost || !odometry_only()),
      .few_landmarks = by_landmarks && tracked.matches.size() < kFewMatches,
      .repetitive_scene =
          anchored() && scene_.repeats_itself(reference_.left, reference_.keyframe.frame, images.frame.index),
      .right_image_unfit = right_image_.judgement() != RightImage::kFits,
  };
  if (found_again(tracked.basis, previous_.lost)) {
    trajectory_.continue_odometry(tracked.prior.pose(), tracked.posterior.pose());
  }
  result.right_image_fits = right_image_.fits();
  learn_velocity(tracked, images.frame.stamp_ns);
  posterior_ = tracked.posterior;
  local_map_.record_observations(tracked.matches, images.features.left, images.frame.index);
  if (settings_.map.update_landmarks) local_map_.update(tracked.matches, posterior_);  // Alg. 4
  note_static_points(tracked);
  const bool both_images = result.right_image_fits && images.frame.has_right();
  if (by_landmarks && both_images) noise_.add(tracked.variance_ratio);
  record(reported(tracked), tracked.measured(), result);
  result.odometry = tracked.odometry.T_previous_current;
  result.matches = static_cast<int>(tracked.matches.size());
  result.nis = tracked.nis;
  result.nis_dof = tracked.nis_dof;
  if (!tracked.measured() || !extend_map(tracked, images)) return;
  result.is_keyframe = true;
  result.weak.right_camera_turned = rectification_.noticed_turn();
  if (anchored()) record_keyframe(result);
}

/// Notes which points are static, for the next frame: those that move with the landmarks. For some frames
/// after a jerk no point is, because a vehicle may have been taken for the street, and its points must not
/// outvote the street's.
void Slam::note_static_points(const TrackedPose& tracked) {
  jerks_.add(tracked.odometry.jerk);
  std::optional<Pose> T_previous_current;
  if (fits_landmarks(tracked) && jerks_.steady()) {
    T_previous_current = previous_.T_keyframe_camera.inverse() * posterior_.pose();
  }
  frontend_->note_static_points(T_previous_current, tracked.matches);
}

/// Chooses the points that the odometry of the next frame starts from, away from the landmarks.
void Slam::prepare_next(const FrameImages& images, const std::vector<Match>& matches,
                        const FrameResult& result) {
  auto landmarks_px = positions(matches);
  for (const auto& landmark : local_map_.landmarks()) {
    if (landmark.last_seen == images.frame.index) landmarks_px.push_back(landmark.last_px);
  }
  if (ignores_right_image()) {
    frontend_->restart();  // no point has a disparity
  } else {
    frontend_->choose_odometry_points(images, view_of(images.frame), landmarks_px);
  }
  previous_.replace_pyramids(images.pyramids);
  previous_.T_keyframe_camera = posterior_.pose();
  previous_.position = trajectory_.frames() - 1;
  previous_.lost = result.status == TrackingStatus::kLost;
}

/// Whether a pose can be measured in the images that the frame has. Without a right one, it can in the
/// patches of landmarks.
bool Slam::can_measure(const StereoFrame& frame) const {
  const bool in_left = started_ && anchored() && settings_.refinement.enabled && !odometry_only();
  return frame.has_left() && (frame.has_right() || in_left);
}

/// A repeated image measures nothing, and neither does one that is not there: the pose is predicted, and the
/// filter waits for the next image.
void Slam::pass_over(const StereoFrame& frame, FrameResult& result, const StageClock& clock) {
  if (!started_) {
    record_unknown(result);
    result.times = clock.times();
    return;
  }
  const bool first = previous_.position + 1 == trajectory_.frames();
  result.weak.repeated_image = can_measure(frame) && first && !previous_.lost;
  result.status = judge({.weak = result.weak});
  PoseGaussian motion;
  motion.pose = velocity_.motion_until(frame.stamp_ns);
  const PoseDensity predicted =
      predict_pose(posterior_, motion, false, settings_, velocity_.unseen_until(frame.stamp_ns));
  record(to_pose_gaussian(predicted), false, result);
  result.times = clock.times();
}

/// Begins the map, if the image shows enough for one.
void Slam::initialise(const FrameImages& images, FrameResult& result) {
  (void)relearn_rows(images.frame);
  trajectory_.begin(images.frame.index);
  local_map_.restart(0);
  frontend_->restart();
  auto points = add_landmarks(images, {});
  started_ = points.size() >= static_cast<std::size_t>(settings_.update.min_matches);
  if (!started_) return record_unknown(result);
  velocity_.found(images.frame.stamp_ns);
  begin_keyframe(images, std::move(points));
  record(to_pose_gaussian(posterior_), true, result);
  result.is_keyframe = true;
}

/// Before the map begins, nothing is known of the pose relative to the frame that will begin it.
void Slam::record_unknown(FrameResult& result) {
  constexpr double kRotation_rad = 1.0;
  constexpr double kTranslation_m = 100.0;
  Vector6<double> sigma;
  sigma << Vector3<double>::Constant(kRotation_rad), Vector3<double>::Constant(kTranslation_m);
  result.status = TrackingStatus::kLost;
  record({Pose::identity(), sigma.cwiseAbs2().asDiagonal()}, false, result);
}

/// The posterior with the covariance that is reported: if it was measured against landmarks, scaled to the
/// noise that the residuals show, or else to the assumed noise. The filter itself goes on with the assumed
/// noise.
PoseGaussian Slam::reported(const TrackedPose& tracked) const {
  PoseGaussian pose = to_pose_gaussian(tracked.posterior);
  if (tracked.basis != PoseBasis::kLandmarks) return pose;
  if (settings_.update.noise_from_residuals && settings_.refinement.enabled) {
    pose.covariance =
        NoiseScale::scaled(pose.covariance, noise_.variance_ratio_of_frame(tracked.variance_ratio));
  } else {
    pose.covariance *= expected_variance_ratio(settings_.update);
  }
  return pose;
}

/// Appends the pose of the frame to the trajectory and writes it into the result.
void Slam::record(const PoseGaussian& T_keyframe_camera, bool measured, FrameResult& result) {
  trajectory_.append(T_keyframe_camera, measured);
  result.keyframe = trajectory_.reference_frame();
  result.segment = segment_.current();
  result.relative_covariance = T_keyframe_camera.covariance;
  result.calibration = calibration_error();
  result.T_world_camera = in_world(T_keyframe_camera, result.calibration);
  result.T_odometry_camera = trajectory_.in_odometry_frame(T_keyframe_camera.pose);
}

/// Replaces the covariances in the result by those of the new keyframe, which contain the rectification's.
void Slam::record_keyframe(FrameResult& result) const {
  result.relative_covariance = trajectory_.T_previous_reference().covariance;
  result.T_world_camera.covariance = in_world(PoseGaussian{}, result.calibration).covariance;
}

/// Completes the result after the map update: the status takes into account whether the segment is localised.
void Slam::complete(const FrameImages& images, FrameEvidence evidence, FrameResult& result) {
  result.weak.segment_not_localised = !segment_.localised();
  evidence.weak = result.weak;
  const bool lost = judge(evidence) == TrackingStatus::kLost;
  evidence.segment_localised = !lost && segment_.take_newly_localised();
  result.status = judge(evidence);
  result.segment = segment_.current();
  result.features = static_cast<int>(frontend_->count_features(images));
  result.landmarks = static_cast<int>(local_map_.landmarks().size());
}

void Slam::learn_velocity(const TrackedPose& tracked, std::int64_t stamp_ns) {
  if (!tracked.measured()) {
    velocity_.unmeasured(stamp_ns);
  } else if (tracked.basis == PoseBasis::kLandmarks && !previous_.lost) {
    velocity_.measured(stamp_ns, posterior_.pose().inverse() * tracked.posterior.pose());
  } else if (tracked.odometry.valid) {
    velocity_.measured(stamp_ns, tracked.odometry.T_previous_current.pose);
  } else {
    velocity_.found(stamp_ns);
  }
}

bool Slam::tracks_correlation() const {
  return anchored() && settings_.map.track_correlation && !settings_.map.update_landmarks;
}

void Slam::finish() {
  std::vector<KeyframeLink> links;
  if (settings_.online_rectification.enabled) links = trajectory_.remeasure(rectification_);
  if (loops_) apply(loops_->finish(links));
}

}  // namespace stereo_slam
