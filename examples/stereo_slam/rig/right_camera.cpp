// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/right_camera.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/rig/calibration_error.hpp"
#include "stereo_slam/rig/motion_evidence.hpp"

namespace stereo_slam {

/// How a frame is seen whose right image is so.
RectificationResidual RightCamera::geometry(const RightImageState& image) const {
  const RectificationResidual at_once = rectification_.current().displaced(image.displacement);
  return is_late() && image.velocity ? at_once.late(image.velocity->motion_in(delay_s())) : at_once;
}

void RightCamera::take(const RightImageState& image, const std::optional<DisplacementEstimate>& left) {
  image_ = image;
  if (is_late()) return;  // displacements by the velocity tell nothing of the rig
  const bool vibrated = vibration_.present();
  if (!image.displacement.isZero(0.0) && !vibrated) vibration_.begin();
  if (left) vibration_.add(image.displacement + left->change);
  if (!vibrated && vibration_.present()) rectification_.forget_disparity_offset(image.displacement.norm());
}

RigVelocity RightCamera::velocity_at_exposure(const RigVelocity& measured) const {
  if (!measured_velocity_) return measured;
  const double ahead = 0.5 * (1.0 + delay_s() / measured.frame_s);  // of the middle of the motion, in frames
  RigVelocity result = measured;
  result.change_per_s = measured.per_s - measured_velocity_->per_s;
  result.per_s += ahead * result.change_per_s;
  result.sigma_m_per_s = ahead * surprise2_.cwiseSqrt();
  return result;
}

Remeasurement RightCamera::expose_with(const std::optional<RigVelocity>& velocity) {
  const RectificationResidual before = geometry(image_);
  image_.velocity = velocity;
  return {before, geometry(image_)};
}

Remeasurement RightCamera::move_with(const RigVelocity& measured, RightImageState& image) const {
  const RectificationResidual before = geometry(image);
  image.velocity->per_s.tail<3>() = velocity_at_exposure(measured).per_s.tail<3>();
  return {before, geometry(image)};
}

Remeasurement RightCamera::displace(const DisplacementEstimate& left) {
  const RectificationResidual before = geometry(image_);
  image_.displacement += left.change;
  image_.covariance = left.covariance;
  return {before, geometry(image_)};
}

Remeasurement RightCamera::move_with(const std::optional<RigVelocity>& measured) {
  const RectificationResidual before = geometry(image_);
  if (measured && image_.velocity)
    image_.velocity->per_s.tail<3>() = velocity_at_exposure(*measured).per_s.tail<3>();
  else if (measured)
    image_.velocity = velocity_at_exposure(*measured);
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

Matrix6<double> RightCamera::velocity_covariance(const SeenMotion& motion) const {
  if (!is_late() || !image_.velocity || !keyframe_velocity_) return Matrix6<double>::Zero();
  const LateExposure first(camera_, keyframe_velocity_->motion_in(delay_s()));
  const LateExposure second(camera_, image_.velocity->motion_in(delay_s()));
  std::vector<Eigen::Matrix<double, 3, 6>> by_steps;
  for (const auto& c : motion.points) {
    Eigen::Matrix<double, 3, 6> by_step = Eigen::Matrix<double, 3, 6>::Zero();
    by_step.leftCols<3>() =
        c.J_first.col(2) * first.disparity_by_step(c.first.head<2>(), c.first.z()).transpose();
    by_step.bottomRightCorner<1, 3>() =
        -second.disparity_by_step(c.second.head<2>(), c.second.z()).transpose();
    by_steps.push_back(by_step);
  }
  const auto derivative = motion_by_parameters(motion.points, by_steps);
  if (!derivative) return Matrix6<double>::Zero();
  Vector6<double> sigma_m;
  sigma_m << keyframe_velocity_->sigma_m_per_s, image_.velocity->sigma_m_per_s;
  const Matrix6<double> root = *derivative * (delay_s() * sigma_m).asDiagonal();
  return root * root.transpose();
}

/// Standard deviation of the displacement of a late right image by what is not known of its velocity: half of
/// what that changed by since the frame before.
ImageDisplacement::Coefficients RightCamera::sigma_by_velocity_px(const RightImageState& image) const {
  constexpr double kShareUnknown = 0.5;
  ImageDisplacement::Coefficients sigma_px = ImageDisplacement::Coefficients::Zero();
  if (!is_late() || !image.velocity) return sigma_px;
  const Vector3<double> rotation_px =
      std::abs(kShareUnknown * delay_s() * camera_.fx) * image.velocity->change_per_s.head<3>();
  sigma_px << rotation_px.y(), rotation_px.x(), rotation_px.z(), rotation_px.y(), rotation_px.x();
  return sigma_px.cwiseAbs();
}

ImageDisplacement::Covariance RightCamera::displacement_information(const RightImageState& image) const {
  constexpr double kLeastVariance_px2 = 0.02 * 0.02;
  constexpr double kClear2 = 25.0;  // five sigma
  const bool vibrates = vibration_.present();
  ImageDisplacement::Coefficients variance_px2 =
      vibrates ? vibration_.mean_square_px2() : sigma_by_velocity_px(image).cwiseAbs2();
  for (int i = 0; i < ImageDisplacement::kSeen; ++i) {
    // It may be larger than any before. A jerk of the rig is seen in the displacement alone.
    const double displacement2 = image.displacement[i] * image.displacement[i];
    if (vibrates || displacement2 > kClear2 * image.covariance(i, i))
      variance_px2[i] = std::max(variance_px2[i], displacement2);
  }
  return (variance_px2.array() + kLeastVariance_px2).inverse().matrix().asDiagonal();
}

std::optional<Remeasurement> RightCamera::test_disparities(const std::optional<SharedDisparityError>& shown) {
  constexpr double kKnown_px2 = 1.0;
  --disparity_tests_left_;
  disparities_tested_ = shown && shown->covariance_px2(0, 0) < kKnown_px2;
  if (!shown || !shown->is_clear()) return std::nullopt;
  const RectificationResidual before = geometry(image_);
  rectification_.begin_displaced(shown->displacement_px, shown->covariance_px2);
  return Remeasurement{before, geometry(image_)};
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

/// The motion from the last keyframe, with what a delay means for each point.
SeenMotion RightCamera::with_delay(SeenMotion motion) const {
  if (!is_late() || !image_.velocity || !keyframe_velocity_) return motion;
  const DelayDerivatives first(rectification_.current(), *keyframe_velocity_, delay_s());
  const DelayDerivatives second(rectification_.current(), *image_.velocity, delay_s());
  for (auto& c : motion.points) {
    c.by_delay = c.J_first.col(2) * first.of(c.first).disparity_px_per_s;
    c.by_delay.z() -= second.of(c.second).disparity_px_per_s;
  }
  return motion;
}

/// Keeps how the motion to a keyframe depends on the rig, of which `before` is the geometry until then.
KeyframeMotion RightCamera::keep(const MotionEvidence& motion, const RectificationResidual& before) {
  motions_.push_back(motion);
  return {motion.covariance, motion.derivative.rightCols<LensResidual::kTerms>(), {before, geometry(image_)}};
}

KeyframeMotion RightCamera::consider(const SeenMotion& by_landmarks) {
  came_to_rest_ = false;
  if (!settings_.enabled) return {};
  return keep(rectification_.consider_motion(with_delay(by_landmarks)), geometry(image_));
}

KeyframeMotion RightCamera::refine(const SeenMotion& by_landmarks, const SeenMotion& by_odometry) {
  came_to_rest_ = false;
  if (!settings_.enabled) return {};
  constexpr double kRigid_px2 = 0.05 * 0.05;  // variance of a displacement that is left out
  const RectificationResidual before = geometry(image_);
  const SeenMotion motion = with_delay(by_landmarks);
  MotionEvidence shown = vibration_.present() || image_.covariance(0, 0) > kRigid_px2
                             ? rectification_.add_motion_of_vibrating_rig(motion, image_.covariance)
                             : rectification_.add_motion(motion);
  if (shown.derivative.isZero(0.0)) {
    shown = rectification_.consider_motion(by_odometry);
    shown.vibrates = vibration_.present();
  }
  if (const auto rest = vibration_.rest()) {
    rectification_.shift(*rest);
    image_.displacement -= *rest;
    vibration_ = {};
    came_to_rest_ = true;
  }
  rectification_.advance();
  if (rectification_.noticed_turn()) image_.monitor.distrust();
  return keep(shown, before);
}

std::vector<MotionChange> RightCamera::correct(const std::vector<Pose>& motions) {
  std::vector<MotionChange> changes;
  if (!settings_.enabled) return changes;
  for (std::size_t i = 0; i < motions.size(); ++i)
    changes.push_back(rectification_.correct(motions_.at(i), motions[i]));
  return changes;
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
