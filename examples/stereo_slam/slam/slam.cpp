// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/slam.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "stereo_slam/frontend/equal_brightness.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/odometry/disparity_error_search.hpp"
#include "stereo_slam/odometry/motion_in_left.hpp"
#include "stereo_slam/tracking/predict.hpp"
#include "stereo_slam/tracking/rig_constraints.hpp"
#include "stereo_slam/tracking/update.hpp"

namespace stereo_slam {

Slam::Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread)
    : Slam(camera, settings, loop_thread, SavedMap{}, MapUse::kContinue) {}

Slam::Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread,
           const SavedMap& loaded, MapUse use)
    : SlamSystem(camera, settings.map),
      settings_(settings),
      posterior_(certain_pose()),
      noise_(expected_variance_ratio(settings.update)),
      right_camera_(camera, settings.online_rectification) {
  if (settings.loop_closure.enabled) path_ = Path(camera, settings, loop_thread, loaded, use);
  if (loaded.camera.width_px == 0) return;
  if (!loaded.keyframes.empty() && !path_.loops()) {
    throw std::invalid_argument("a run is localised in a loaded map by loop closure; enable loop_closure");
  }
  check_camera_of(loaded, camera);
  right_camera_.resume(loaded.rectification);
}

FrameResult Slam::process(const StereoFrame& recorded, AssociationTrace* trace) {
  FrameResult result{.index = recorded.index, .stamp_ns = recorded.stamp_ns};
  StageClock clock(result.times);
  result.loop_corrected = path_.correct_before(recorded.index);
  if (path_.loops()) clock.lap("loops");
  const StereoFrame frame = with_equal_brightness(recorded);
  motion_.inertial().begin_frame(frame.stamp_ns, frame.imu);
  if (!can_measure(frame) || previous_.repeated_by(frame)) {
    pass_over(frame, result);
    return result;
  }
  const FrameImages images = prepare_images(frame, PyramidSides::kLeft, previous_);
  clock.lap("images");
  FrameEvidence evidence{.after_loss = previous_.lost};
  std::vector<Match> matches;
  if (reference_.begun()) {
    const TrackedPose tracked = track(images, trace, clock);
    integrate(tracked, images, result);  // trajectory, keyframes
    matches = tracked.matches;
    evidence.basis = tracked.basis();
    evidence.turn_measured = result.is_keyframe && right_camera_.noticed_turn();
  } else {
    initialise(images, result);
    evidence.begins_map = reference_.begun();
  }
  complete(images, evidence, result);
  clock.lap("map");
  prepare_next(images, matches, result);
  clock.lap("stereo");
  return result;
}

/// The pose of a frame: measurements, update; if it is lost, relocalisation.
TrackedPose Slam::track(const FrameImages& images, AssociationTrace* trace, StageClock& clock) {
  correct_last_exposure(images);
  find_first_displacement(images);
  FrameMeasurement measured = measure(images, trace, clock);
  right_camera_.take(measured.right, measured.displacement_left);
  tracks_ = std::move(measured.tracks);
  local_map_.predict_correlation(measured.inertial
                                     ? measured.inertial->camera_regression
                                     : measured.odometry.T_previous_current.pose.inverse().adjoint());
  auto tracked = update(std::move(measured), images.frame.stamp_ns);  // eq. 13
  clock.lap("update");
  if (!right_camera_.is_ignored() && (previous_.lost || !tracked.measured())) {
    if (const auto found = relocalise(images)) {
      tracked.update.posterior = *found;
      tracked.by_keyframe = true;
    }
    clock.lap("recognise");
  }
  return tracked;
}

/// Corrects how the rig moved until the right image of the last frame was exposed, if that is late and the
/// frame is a keyframe: the disparities of its landmarks depend on the velocity then, and this motion tells
/// the velocity after it. When the map begins, none was known, and the motion depends on the disparities.
void Slam::correct_last_exposure(const FrameImages& images) {
  constexpr int kFirstRounds = 4;  // lengths are up to a third wrong, and every round leaves a third
  const bool first = !motion_.known();
  const bool after_keyframe = !previous_.lost && path_.trajectory().reference_frame() + 1 == path_.frames();
  if (!right_camera_.is_late() || !(first || after_keyframe)) return;
  for (int rounds = first ? kFirstRounds : 1; rounds > 0; --rounds) {
    const RightImageState right = next_right_image(images);
    FrameMeasurement measured = begin_measurement(right, displacement_in(images, right));
    measure_motion(images, measured);
    const auto velocity =
        measured.odometry.valid
            ? motion_.velocity_by(measured.odometry.T_previous_current.pose, images.frame.stamp_ns)
            : std::nullopt;
    if (!velocity) return;
    const Remeasurement change = right_camera_.expose_with(*velocity);
    tracks_.remeasure(change);
    local_map_.remeasure(change);
  }
}

/// Finds by how much the right images are displaced with which the map began, by the first motion that the
/// left images show. A small displacement is left to the motions to come.
void Slam::find_first_displacement(const FrameImages& images) {
  if (!right_camera_.learns() || right_camera_.is_late()) return;
  if (!right_camera_.tests_disparities(motion_.known())) return;
  constexpr double kTells = 0.1;  // baselines, in a frame: it moves a point by a tenth of its disparity
  const StereoCamera& camera = right_camera_.camera();
  const auto velocity = motion_.velocity();
  if (velocity && velocity->per_s.tail<3>().norm() * velocity->frame_s < kTells * camera.baseline_m) return;
  std::vector<StereoPoint> previous;
  std::vector<Vector2<double>> current_px;
  for (const auto& point :
       follow_in_left(points_of_previous(), {previous_.pyramids, images.flow_pyramids},
                      right_camera_.view_of(images.frame),
                      motion_.expected_until(images.frame.stamp_ns).T_previous_current, settings_.odometry)) {
    previous.push_back(point.previous.z);
    current_px.push_back(right_camera_.lens().corrected(point.left_px));
  }
  const auto error =
      find_shared_disparity_error(previous, current_px, camera, settings_.odometry.pixel_sigma_px);
  const auto change = right_camera_.test_disparities(error);
  if (!change) return;
  tracks_.remeasure(*change);
  local_map_.remeasure(*change);
}

/// Takes the displacement of the right image that the landmarks show, if it is not known from the frames
/// before, and returns the covariance that its uncertainty adds to a pose that they measure.
Matrix6<double> Slam::correct_displacement(FrameMeasurement& measured) {
  if (!measured.displacement_left) return Matrix6<double>::Zero();
  if (!right_camera_.is_displaced())
    return measured.displacement_left->pose_covariance(measured.right.covariance);
  const Remeasurement change = right_camera_.displace(*measured.displacement_left);
  tracks_.remeasure(change);
  for (auto& match : measured.matches) match.z = change.of(match.left_px, match.z);
  return measured.displacement_left->pose_covariance(measured.displacement_left->covariance);
}

TrackedPose Slam::update(FrameMeasurement measured, std::int64_t stamp_ns) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const PoseGaussian& prior = measured.prior;
  const Matrix6<double> by_displacement = correct_displacement(measured);
  PoseUpdate update{.posterior = prior};
  if (usual_basis() == PoseBasis::kLandmarks)
    update = update_pose(prior, measured.matches, local_map_.view(), settings_.update);
  if (!settings_.update.noise_from_residuals) update.variance_ratio.setConstant(kUnknown);
  const bool left_alone = !uses_right_image();
  if (left_alone && jumps(prior.pose, update.posterior, stamp_ns)) update = {.posterior = prior};
  local_map_.update_correlation(prior, update.posterior.pose, update.used);
  if (left_alone) update.nis_dof -= static_cast<int>(update.used.size());  // they have no disparity
  if (update.converged) update.posterior.covariance += by_displacement;
  return {std::move(measured), std::move(update)};
}

/// Whether a measured position is more than half a baseline a frame from the predicted one, and its
/// uncertainty does not explain this. Without a known motion nothing is a jump. If the right images are
/// ignored, it may mean that the two images are swapped, or that the left ones are late.
bool Slam::jumps(const Pose& predicted, const PoseGaussian& measured, std::int64_t stamp_ns) const {
  constexpr double kSigmas = 3.0;
  if (!motion_.known()) return false;
  const UnseenSteps unseen = motion_.unseen_until(stamp_ns);
  const double sigma_m = std::sqrt(measured.covariance.bottomRightCorner<3, 3>().trace());
  const double jump_m = (measured.pose.translation() - predicted.translation()).norm();
  return jump_m > 0.5 * right_camera_.camera().baseline_m * (unseen.before + unseen.now) + kSigmas * sigma_m;
}

/// The pose by the points of the last keyframe, if they are recognised. In the first frame that is not
/// tracked, a surprising pose is not believed: the points may be on a vehicle.
std::optional<PoseGaussian> Slam::relocalise(const FrameImages& images) const {
  // Features of all pyramid levels: the camera may have come nearer since the keyframe.
  const StereoView view = right_camera_.view_of(images.frame);
  const auto points =
      measure_stereo_points(view, extract_features(images.frame.left, settings_.features), {}, settings_);
  Keyframe keyframe = reference_.keyframe;
  describe(keyframe.points, reference_.left, right_camera_.lens());
  auto found =
      recognise_keyframe(keyframe, {local_map_.landmarks(), reference_.left}, view, points, settings_);
  if (!found || previous_.lost) return found;
  const Pose T_previous_current = posterior_.pose.inverse() * found->pose;
  return motion_.expected_until(images.frame.stamp_ns).surprised_by(T_previous_current) ? std::nullopt
                                                                                        : found;
}

void Slam::integrate(const TrackedPose& tracked, const FrameImages& images, FrameResult& result) {
  result.weak = weaknesses(tracked, images.frame.index);
  result.right_image_fits = right_camera_.fits();
  if (found_again(tracked.basis(), previous_.lost)) {
    path_.trajectory().continue_odometry(tracked.prior.pose, tracked.update.posterior.pose);
  }
  const Pose T_keyframe_previous = posterior_.pose;
  const Gap gap = motion_.gap_until(images.frame.stamp_ns);
  motion_.learn(tracked, noise_.as_seen(tracked.update.posterior), T_keyframe_previous, previous_.lost,
                images.frame.stamp_ns);
  // A late right image is seen with the velocity of the motion to its frame from now on.
  if (right_camera_.is_late()) tracks_.remeasure(right_camera_.move_with(motion_.velocity()));
  posterior_ = tracked.update.posterior;
  local_map_.record_observations(tracked.matches, {}, images.frame.index);
  note_static_points(tracked, T_keyframe_previous);
  if (reference_.motion_stereo.size() > 0) {
    reference_.motion_stereo.follow({previous_.pyramids, images.flow_pyramids}, T_keyframe_previous,
                                    posterior_, right_camera_.left_camera());
  }
  const bool both_images = result.right_image_fits && uses_right_image();
  if (tracked.basis() == PoseBasis::kLandmarks && both_images) noise_.add(tracked.update.variance_ratio);
  result.weak.imu_contradicted = motion_.inertial().given_up();
  result.weak.sudden_motion = motion_.in_doubt();
  PoseGaussian pose = reported(tracked);
  if (fits_landmarks(tracked) && reference_.has_stereo_depths()) {
    const SeenMotion motion = seen_motion(tracked.matches, local_map_.view(), pose.pose);
    pose.covariance += right_camera_.note_frame(path_.frames(), motion);
  }
  path_.append(pose, tracked.basis() != PoseBasis::kNothing, calibration_error(), result);
  tracked.report(result);
  if (!tracked.measured() || !extend_map(tracked, images, gap)) return;
  result.is_keyframe = true;
  result.weak.right_camera_turned = right_camera_.noticed_turn();
  path_.report_keyframe(result);
}

/// Why the pose may be less certain than its covariance says, as far as the measurements tell.
WeakReasons Slam::weaknesses(const TrackedPose& tracked, std::size_t frame) {
  return {
      .odometry_alone = tracked.basis() == PoseBasis::kOdometry &&
                        (previous_.lost || usual_basis() != PoseBasis::kOdometry),
      .imu_alone = tracked.basis() == PoseBasis::kImu,
      .few_landmarks = tracked.has_few_landmarks(),
      .repetitive_scene = reference_.is_ambiguous(frame),
      .right_image_unfit = right_camera_.judgement() != RightImage::kFits,
  };
}

/// Notes which points are static, for the next frame: those whose motion in the image agrees with that of the
/// camera. A surprising motion may be that of a vehicle, whose points must not outvote the street's: all
/// begin anew then.
void Slam::note_static_points(const TrackedPose& tracked, const Pose& T_keyframe_previous) {
  std::optional<Pose> T_previous_current;
  if (fits_landmarks(tracked) && !tracked.odometry.surprising) {
    T_previous_current = T_keyframe_previous.inverse() * posterior_.pose;
  }
  tracks_.compare_with(T_previous_current, right_camera_.camera(), settings_.odometry.pixel_sigma_px);
}

/// Completes the result after the map update: the status takes into account whether the segment is localised.
void Slam::complete(const FrameImages& images, FrameEvidence evidence, FrameResult& result) {
  SegmentState& segment = path_.segment();
  result.weak.segment_not_localised = !segment.localised();
  evidence.weak = result.weak;
  evidence.segment_predicted = segment.predicted(path_.frames());
  const bool lost = judge(evidence) == TrackingStatus::kLost;
  evidence.segment_localised = !lost && segment.take_newly_localised();
  result.status = judge(evidence);
  result.segment = segment.current();
  result.inertial = with_calibration_error(motion_.inertial().estimate(), calibration_error());
  result.features = static_cast<int>(tracks_.points().size());
  result.landmarks = static_cast<int>(local_map_.landmarks().size());
  const bool unmeasured = result.status == TrackingStatus::kLost || !result.right_image_fits;
  if (reference_.begun() && right_camera_.end_frame(images.frame, unmeasured))
    result.weak.right_camera_turned = true;
}

/// Chooses the points that the odometry of the next frame starts from, away from the landmarks.
void Slam::prepare_next(const FrameImages& images, const std::vector<Match>& matches,
                        const FrameResult& result) {
  auto landmarks_px = positions(matches);  // also those of the keyframe before, if there is a new one
  for (const auto& px : local_map_.observed_in(images.frame.index)) landmarks_px.push_back(px);
  if (right_camera_.is_ignored()) {
    tracks_ = {};  // no point has a disparity
  } else {
    tracks_.replenish(right_camera_.view_of(images.frame), landmarks_px, settings_);
  }
  previous_.replace(images.pyramids, path_.frames(), result.status == TrackingStatus::kLost);
  previous_.matches = matches.size();
}

/// Whether a pose can be measured in the images that the frame has. Without a right one, it can in the
/// patches of landmarks.
bool Slam::can_measure(const StereoFrame& frame) const {
  const bool in_left = reference_.begun() && usual_basis() == PoseBasis::kLandmarks;
  return frame.has_left() && (frame.has_right() || in_left);
}

/// A repeated image measures nothing, and neither does one that is not there: the pose is predicted, and the
/// filter waits for the next image.
void Slam::pass_over(const StereoFrame& frame, FrameResult& result) {
  if (!reference_.begun()) return path_.append_unknown(calibration_error(), result);
  const bool repeated = can_measure(frame);
  const bool waits = repeated && previous_.is_last_of(path_.frames()) && !previous_.lost;
  const auto inertial = motion_.inertial().predicted()
                            ? std::optional(motion_.inertial().prior(std::nullopt).T_keyframe_camera)
                            : std::nullopt;
  result.inertial = with_calibration_error(motion_.inertial().estimate(), calibration_error());
  result.weak = {.imu_alone = inertial.has_value(),
                 .repeated_image = repeated,
                 .right_image_unfit = !frame.has_right(),
                 .segment_not_localised = !path_.segment().localised()};
  result.status =
      judge({.basis = inertial ? PoseBasis::kImu : PoseBasis::kNothing, .waits = waits, .weak = result.weak});
  if (inertial) return path_.append(*inertial, true, calibration_error(), result);
  const PoseGaussian predicted =
      noise_.as_seen(predicted_pose(motion_.guessed_until(frame.stamp_ns, settings_.motion)));
  path_.append(predicted, false, calibration_error(), result);
}

/// Begins the map, if the image shows enough for one.
void Slam::initialise(const FrameImages& images, FrameResult& result) {
  (void)right_camera_.relearn_rows(images.frame);
  right_camera_.begin_late(images.frame);
  path_.trajectory().begin(images.frame.index);
  local_map_.restart(0);
  tracks_ = {};
  auto points = add_stereo_landmarks(images);
  if (right_camera_.refuse_learned()) {
    (void)right_camera_.relearn_rows(images.frame);
    local_map_.restart(0);
    points = add_stereo_landmarks(images);
  }
  if (points.size() < static_cast<std::size_t>(settings_.update.min_matches))
    return path_.append_unknown(calibration_error(), result);
  motion_.begin_map(images.frame.stamp_ns);
  begin_keyframe(images, std::move(points));
  path_.append(posterior_, true, calibration_error(), result);
  result.is_keyframe = true;
}

/// The posterior with the covariance that its measurements have: the filter's, which is in units of the
/// assumed noise of the pixels, times what the residuals show of the noise. (A pose by the last keyframe has
/// no such factor yet.)
PoseGaussian Slam::measured_pose(const TrackedPose& tracked) const {
  if (tracked.basis() == PoseBasis::kKeyframe) return tracked.update.posterior;
  if (tracked.basis() != PoseBasis::kLandmarks) return noise_.as_seen(tracked.update.posterior);
  PoseGaussian pose = tracked.update.posterior;
  pose.covariance =
      NoiseScale::scaled(pose.covariance, noise_.variance_ratio_of_frame(tracked.update.variance_ratio));
  return pose;
}

/// The pose with the covariance that is reported: with the drift of the images, if an IMU is used, and with
/// the error of the scale that the landmarks share, if their depths are from the motion of the left camera.
PoseGaussian Slam::reported(const TrackedPose& tracked) const {
  PoseGaussian pose = measured_pose(tracked);
  const Vector3<double> error_m = reference_.scale_sigma * pose.pose.inverse().translation();
  pose.covariance.bottomRightCorner<3, 3>() += error_m * error_m.transpose();
  if (const auto drift = motion_.inertial().drift_covariance()) pose.covariance += *drift;
  if (right_camera_.is_late() && fits_landmarks(tracked)) {
    pose.covariance +=
        right_camera_.exposure_covariance(seen_motion(tracked.matches, local_map_.view(), pose.pose));
  }
  return pose;
}

void Slam::finish() {
  const auto frames = right_camera_.frame_changes(path_.trajectory().relative_poses());
  path_.finish(right_camera_.correct(path_.trajectory().motions()), frames);
}

std::optional<InertialSummary> Slam::inertial() const {
  const InertialSummary& summary = motion_.inertial().summary();
  return summary.phase == InertialPhase::kNone ? std::nullopt : std::optional(summary);
}

SavedMap Slam::saved_map() const {
  SavedMap map;
  const LearnedCameras cameras = right_camera_.learned();
  map.camera = cameras.camera;
  map.rectification = cameras.estimate;
  path_.save(local_map_, map);
  return map;
}

}  // namespace stereo_slam
