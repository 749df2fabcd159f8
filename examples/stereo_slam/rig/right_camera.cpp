// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/right_camera.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/LU>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/rig/calibration_error.hpp"
#include "stereo_slam/rig/motion_evidence.hpp"

namespace stereo_slam {
namespace {

constexpr double kLeastVariance_px2 = 0.02 * 0.02;  // of a displacement

[[nodiscard]] LateMotion motion_with(const Vector6<double>& per_s, double delay_s) {
  LateMotion motion;
  motion.turn_rad = delay_s * per_s.head<3>();
  motion.m_per_s = per_s.tail<3>();
  return motion;
}

}  // namespace

/// How a frame is seen whose right image is so.
PairGeometry RightCamera::geometry(const RightImageState& image) const {
  const PairGeometry at_once = rectification_.current().displaced(image.displacement);
  return is_late() && image.late ? at_once.late(image.late->in(delay_s())) : at_once;
}

RightImageState RightCamera::next_image(bool has_right) const {
  RightImageState next{.monitor = image_.monitor, .late = image_.late};
  next.monitor.begin_frame(has_right);
  if (is_late()) return next;
  next.displacement = vibration_.held().displacement;
  next.covariance = vibration_.held().covariance;
  return next;
}

void RightCamera::take(const RightImageState& image, const std::optional<DisplacementEstimate>& left) {
  image_ = image;
  if (is_late()) return;  // displacements by the velocity tell nothing of the rig
  const bool vibrated = vibration_.present();
  const RightImageState shown = left ? displaced(image, *left) : image;
  if (!vibrated && !expects(image))
    vibration_.jump(shown.displacement, shown.covariance);
  else if (left) {
    vibration_.add(shown.displacement);
    vibration_.measure_held(shown.displacement, shown.covariance);
  }
  if (!vibrated && vibration_.present()) rectification_.forget_disparity_offset(image.displacement.norm());
}

LateMotion RightCamera::motion_until_exposure(const RigVelocity& measured) const {
  const double ahead = 0.5 * (1.0 + delay_s() / measured.frame_s);  // of the middle of the motion, in frames
  const Vector6<double> change_per_s = measured_velocity_
                                           ? Vector6<double>(measured.per_s - measured_velocity_->per_s)
                                           : Vector6<double>::Zero();
  LateMotion result = motion_with(measured.per_s + ahead * change_per_s, delay_s());
  result.sigma_m_per_s = ahead * surprise2_.cwiseSqrt();
  return result;
}

std::optional<LateMotion> RightCamera::motion_by_rows(const StereoFrame& frame) const {
  const auto displacement = rectification_.displacement_of_rows(match_corners(frame.left, frame.right));
  if (!displacement) return std::nullopt;
  return LateMotion{.turn_rad = ImageDisplacement::rotation(*displacement, camera_)};
}

/// The velocity is between those of the motions before and after the frame. The turn that the images showed
/// is relative to that of the keyframe before, whose error it shares. If the right camera vibrates besides,
/// it turns by more than the velocity and what is not known of it.
Remeasurement RightCamera::expose_with(const RigVelocity& next) {
  constexpr double kBetween = 0.5;  // of the change: velocities jump anywhere between two frames
  const PairGeometry before = geometry(image_);
  const RigVelocity last = measured_velocity_.value_or(next);
  const double ahead = 0.5 * (1.0 + delay_s() / next.frame_s);
  const Vector6<double> change_per_s = next.per_s - last.per_s;
  const Vector6<double> per_s = last.per_s + ahead * change_per_s;
  LateMotion late = motion_with(per_s, delay_s());
  late.sigma_m_per_s = kBetween * change_per_s.tail<3>().cwiseAbs();
  Vector3<double> variance_rad2 = (kBetween * delay_s() * change_per_s.head<3>()).cwiseAbs2() +
                                  (rectification_.delay()->sigma_s * per_s.head<3>()).cwiseAbs2() +
                                  Vector3<double>::Constant(kLeastVariance_px2 / (camera_.fx * camera_.fx));
  if (measured_velocity_ && keyframe_motion_ && image_.late) {
    const Vector3<double> of_shown_rad2 = keyframe_motion_->sigma_turn_rad.cwiseAbs2();
    const Vector3<double> shown_rad = image_.late->turn_rad + image_.late->turn_left_rad;
    turns_.add(shown_rad - late.turn_rad, variance_rad2 + of_shown_rad2);
    variance_rad2 += turns_.value();
    const Vector3<double> gain = variance_rad2.cwiseQuotient(variance_rad2 + of_shown_rad2);
    late.turn_left_rad = gain.cwiseProduct(shown_rad - late.turn_rad);
    variance_rad2 -= gain.cwiseProduct(variance_rad2);
  }
  late.sigma_turn_rad = variance_rad2.cwiseSqrt();
  keyframe_motion_ = image_.late = late;
  Remeasurement change{before, geometry(image_)};
  for (auto& match : keyframe_matches_) match = change.of(match);
  if (measured_velocity_) rectification_.add_delay(keyframe_matches_, late);
  return change;
}

/// The motion until its exposure has the error of the rotation that the images showed, relative to the
/// keyframe before, until the next frame tells more.
void RightCamera::begin_late_keyframe(std::span<const StereoMeasurement> matches) {
  std::optional<LateMotion> motion = image_.late;
  if (motion && keyframe_motion_) {
    const Vector3<double> variance_px2(image_.covariance(1, 1), image_.covariance(0, 0),
                                       image_.covariance(2, 2));
    motion->sigma_turn_rad =
        (keyframe_motion_->sigma_turn_rad.cwiseAbs2() + variance_px2 / (camera_.fx * camera_.fx)).cwiseSqrt();
  }
  keyframe_motion_ = motion;
  keyframe_matches_.assign(matches.begin(), matches.end());
}

Remeasurement RightCamera::move_with(const RigVelocity& measured, RightImageState& image) const {
  const PairGeometry before = geometry(image);
  image.late->m_per_s = motion_until_exposure(measured).m_per_s;
  return {before, geometry(image)};
}

RightImageState RightCamera::displaced(const RightImageState& image, const DisplacementEstimate& left) const {
  RightImageState result = image;
  result.covariance = left.covariance;
  if (is_late() && image.late)
    result.late->turn_left_rad += ImageDisplacement::rotation(left.change, camera_);
  else
    result.displacement += left.change;
  return result;
}

Remeasurement RightCamera::displace(const DisplacementEstimate& left) {
  const PairGeometry before = geometry(image_);
  image_ = displaced(image_, left);
  return {before, geometry(image_)};
}

Remeasurement RightCamera::move_with(const std::optional<RigVelocity>& measured) {
  const PairGeometry before = geometry(image_);
  if (measured && image_.late)
    image_.late->m_per_s = motion_until_exposure(*measured).m_per_s;
  else if (measured)
    image_.late = motion_until_exposure(*measured);
  if (measured && measured_velocity_) {
    constexpr int kMemory = 10;  // frames
    const Vector6<double> change_per_s = measured->per_s - measured_velocity_->per_s;
    surprises_ = std::min(surprises_ + 1, kMemory);
    surprise2_ += ((change_per_s - change_per_s_).tail<3>().cwiseAbs2() - surprise2_) / surprises_;
    change_per_s_ = change_per_s;
  }
  measured_velocity_ = measured;
  return {before, geometry(image_)};
}

Matrix6<double> RightCamera::exposure_covariance(const SeenMotion& motion) const {
  const SeenMotion late = with_exposures(motion);
  if (late.late.empty()) return Matrix6<double>::Zero();
  const auto evidence = evidence_of_motion(late, rectification_.current(), {}, camera_, false);
  return evidence ? evidence->exposure_covariance : Matrix6<double>::Zero();
}

DisplacementPrior RightCamera::searched_displacement() const {
  constexpr double kVariance_px2 = 20.0 * 20.0;
  DisplacementPrior prior;
  prior.information.diagonal().setConstant(1.0 / kVariance_px2);
  if (!is_late()) return prior;
  const auto by_turn = ImageDisplacement::by_rotation(camera_);
  ImageDisplacement::Covariance covariance =
      kVariance_px2 / (camera_.fx * camera_.fx) * by_turn * by_turn.transpose();
  covariance.diagonal().array() += kLeastVariance_px2;
  prior.information = covariance.inverse();
  return prior;
}

DisplacementPrior RightCamera::displacement_prior(const RightImageState& image) const {
  DisplacementPrior prior = searched_displacement();
  prior.mean = -image.displacement;
  if (is_late()) {
    if (image.late) prior.mean -= ImageDisplacement::by_rotation(camera_) * image.late->turn_left_rad;
    return prior;
  }
  ImageDisplacement::Coefficients variance_px2 = vibration_.mean_square_px2();
  for (int i = 0; i < ImageDisplacement::kSeen; ++i)  // it may be larger than any before
    variance_px2[i] = std::max(variance_px2[i], image.displacement[i] * image.displacement[i]);
  prior.information = (variance_px2.array() + kLeastVariance_px2).inverse().matrix().asDiagonal();
  return prior;
}

std::optional<Remeasurement> RightCamera::test_disparities(const std::optional<SharedDisparityError>& shown) {
  constexpr double kKnown_px2 = 1.0;
  --disparity_tests_left_;
  disparities_tested_ = shown && shown->covariance_px2(0, 0) < kKnown_px2;
  if (!shown || !shown->is_clear()) return std::nullopt;
  const PairGeometry before = geometry(image_);
  rectification_.begin_displaced(shown->displacement_px, shown->covariance_px2);
  return Remeasurement{before, geometry(image_)};
}

bool RightCamera::refuse_learned() {
  if (!rectification_.contradicts_learned()) return false;
  rectification_ = RectificationEstimator(camera_, settings_);
  refused_learned_ = true;
  return true;
}

void RightCamera::begin_late(const StereoFrame& frame) {
  if (!is_late()) return;
  if (const auto motion = motion_by_rows(frame)) image_.late = motion;
}

bool RightCamera::relearn_rows(const StereoFrame& frame) {
  return settings_.enabled && !is_late() &&
         rectification_.relearn_rows(match_corners(frame.left, frame.right));
}

bool RightCamera::end_frame(const StereoFrame& frame, bool unmeasured) {
  unmeasured_frames_ = unmeasured ? unmeasured_frames_ + 1 : 0;
  if (unmeasured_frames_ % kRelearnInterval != kFirstRelearn || !relearn_rows(frame)) return false;
  image_.monitor.distrust();
  return true;
}

/// The motion from the last keyframe, with what the exposures of late right images mean for each point.
SeenMotion RightCamera::with_exposures(SeenMotion motion) const {
  if (!is_late() || !image_.late || !keyframe_motion_) return motion;
  const LateExposure first(camera_, keyframe_motion_->in(delay_s()));
  const LateExposure second(camera_, image_.late->in(delay_s()));
  const auto by_turn = [&](const StereoPoint& z) -> Eigen::RowVector3d {
    return ImageDisplacement::basis({z.x() - z.z(), z.y()}, camera_).row(0) *
           ImageDisplacement::by_rotation(camera_);
  };
  for (auto& c : motion.points) {
    LatePoint& point = motion.late.emplace_back();
    point.by_second_turn.row(2) = -by_turn(c.second);
    const Eigen::RowVector3d by_first = first.by_step(c.first.head<2>(), c.first.z()).row(0);
    const Eigen::RowVector3d by_second = second.by_step(c.second.head<2>(), c.second.z()).row(0);
    point.by_exposures.leftCols<3>() = c.J_first.col(2) * by_turn(c.first);
    point.by_exposures.middleCols<3>(3) = c.J_first.col(2) * by_first;
    point.by_exposures.bottomRightCorner<1, 3>() = -by_second;
    c.by_delay = c.J_first.col(2) * by_first.dot(keyframe_motion_->m_per_s);
    c.by_delay.z() -= by_second.dot(image_.late->m_per_s);
  }
  const double delay = std::abs(delay_s());
  motion.sigma_late << rectification_.delay()->sigma_s, keyframe_motion_->sigma_turn_rad,
      delay * keyframe_motion_->sigma_m_per_s, delay * image_.late->sigma_m_per_s;
  return motion;
}

/// Keeps how the motion to a keyframe depends on the rig, of which `before` is the geometry until then.
KeyframeMotion RightCamera::keep(const MotionEvidence& motion, const PairGeometry& before) {
  motions_.push_back(motion);
  return {motion.covariance,
          motion.derivative.rightCols<LensResidual::kTerms>(),
          {before, geometry(image_)},
          rectification_.change_in_use(motion)};
}

KeyframeMotion RightCamera::consider(const SeenMotion& by_landmarks) {
  came_to_rest_ = false;
  if (!settings_.enabled) return {};
  return keep(rectification_.consider_motion(with_exposures(by_landmarks)), geometry(image_));
}

KeyframeMotion RightCamera::refine(const SeenMotion& by_landmarks, const SeenMotion& by_odometry) {
  came_to_rest_ = false;
  if (!settings_.enabled) return {};
  const PairGeometry before = geometry(image_);
  const SeenMotion motion = with_exposures(by_landmarks);
  const ImageDisplacement::Covariance& held = vibration_.held().covariance;
  MotionEvidence shown = vibrates() ? rectification_.add_motion_of_vibrating_rig(
                                          motion, held.isZero(0.0) ? image_.covariance : held)
                                    : rectification_.add_motion(motion);
  if (shown.derivative.isZero(0.0)) {
    shown = rectification_.consider_motion(by_odometry);
    shown.vibrates = vibration_.present();
  }
  if (const auto rest = vibration_.rest()) {
    rectification_.shift(*rest);
    image_.displacement -= *rest;
    vibration_.settle();
    came_to_rest_ = true;
  }
  vibration_.begin_keyframe();
  rectification_.advance();
  return keep(shown, before);
}

std::vector<MotionChange> RightCamera::correct(const std::vector<Pose>& motions) {
  std::vector<MotionChange> changes;
  if (!settings_.enabled) return changes;
  const auto history = rectification_.history();
  for (std::size_t i = 0; i < motions.size(); ++i)
    changes.push_back(rectification_.correct(motions_.at(i), motions[i], history));
  return changes;
}

Matrix6<double> RightCamera::note_frame(std::size_t position, const SeenMotion& by_landmarks) {
  if (!settings_.enabled) return Matrix6<double>::Zero();
  const auto dependence = rectification_.dependence_of(with_exposures(by_landmarks), vibrates());
  if (!dependence) return Matrix6<double>::Zero();
  frames_.push_back({position, motions_.size(), *dependence});
  return dependence->covariance.cast<double>();
}

std::vector<FrameChange> RightCamera::frame_changes(const std::vector<Pose>& T_keyframe_frame) const {
  std::vector<FrameChange> changes;
  const auto history = rectification_.history();
  for (const auto& frame : frames_) {
    if (frame.keyframe == motions_.size()) break;  // nothing was learned since the last keyframe
    changes.push_back({frame.position, rectification_.correct(frame.dependence, motions_[frame.keyframe],
                                                              T_keyframe_frame.at(frame.position), history)});
  }
  return changes;
}

/// Whether the last right image was displaced against that of the keyframe.
bool RightCamera::vibrates() const {
  return !is_late() && (vibration_.present() || !image_.covariance.isZero(0.0));
}

RigSummary RightCamera::summary() const {
  RigSummary summary{.right_delay = rectification_.delay(),
                     .refused_learned = refused_learned_ || rectification_.dropped_learned()};
  if (!settings_.enabled) return summary;
  summary.lens_error = rectification_.lens_error();
  summary.learned = learned();
  // While the rig vibrates, a displacement is no error of the calibration.
  if (rectification_.has_large_error() && !vibration_.present())
    summary.right_image_displacement_px = rectification_.current().coefficients()(0, 0);
  return summary;
}

CalibrationError RightCamera::calibration_error(const CalibrationSettings& allowed) const {
  return allowed_calibration_error(allowed, camera_, rectification_.current().rms_offset_px().y(),
                                   rectification_.scale_sigma());
}

}  // namespace stereo_slam
