// SPDX-License-Identifier: MIT
// What a RectificationEstimator has learned since a motion was measured.
#include "stereo_slam/rig/rectification_estimator.hpp"

namespace stereo_slam {
namespace {

/// Whether a change is too large for derivatives.
[[nodiscard]] bool is_large(const CameraErrors::Coefficients& change) {
  return PairGeometry::rms(change.head<PairGeometry::kTerms>()) >= CameraErrors::kLargeChange_px;
}

}  // namespace

/// The errors of now, and what is expected until the next keyframe.
ErrorsDuring RectificationEstimator::errors_now() const {
  constexpr int kErrors = CameraErrors::kTerms;
  const CameraErrors::Evidence now = disparity_.estimate();
  const double sigma_px = disparity_.drift_sigma_px();
  ErrorsDuring result;
  result.mean.head<kErrors>() = now.mean();
  result.covariance.topLeftCorner<kErrors, kErrors>() = now.covariance();
  result.covariance.diagonal().tail<ImageDisplacement::kTerms>().setConstant(sigma_px * sigma_px);
  return result;
}

/// The errors during a motion that was added, or the estimate now; those of a vibrating rig held for the
/// motion alone.
ErrorsDuring RectificationEstimator::errors_during(const MotionEvidence& motion,
                                                   const History& history) const {
  ErrorsDuring result = motion.motion < history.size() ? history[motion.motion] : errors_now();
  if (motion.vibrates) result.mean << motion.applied, ImageDisplacement::Coefficients::Zero();
  return result;
}

/// The errors that hold for a motion: those that are known now, unless it contradicts a large change.
ErrorsDuring RectificationEstimator::believed_during(const MotionEvidence& motion,
                                                     const History& history) const {
  constexpr double kContradiction = 12.0;  // log of a likelihood ratio
  ErrorsDuring errors = errors_during(motion, history);
  decltype(errors.mean) applied;
  applied << motion.applied, motion.applied_displacement;
  const bool contradicts =
      is_large(errors.coefficients() - motion.applied) &&
      motion.evidence.log_density(applied) > motion.evidence.log_density(errors.mean) + kContradiction;
  if (contradicts) errors.mean = applied;
  return errors;
}

CameraErrors::Coefficients RectificationEstimator::coefficients_during(const MotionEvidence& motion,
                                                                       const History& history) const {
  return believed_during(motion, history).coefficients();
}

/// Change of a motion if it is measured with these coefficients, and the best estimate of the delay, to first
/// order.
Vector6<double> RectificationEstimator::change_by(const MotionEvidence& motion,
                                                  const CameraErrors::Coefficients& coefficients) const {
  return motion.derivative * (coefficients - motion.applied) +
         motion.derivative_by_delay * (used_delay().seconds - motion.applied_delay_s);
}

Vector6<double> RectificationEstimator::change_in_use(const MotionEvidence& motion) const {
  if (motion.vibrates) return Vector6<double>::Zero();
  return change_by(motion, applied());
}

/// Covariance of the change of a motion, as far as it is not of first order: zero unless the estimate changed
/// much.
Matrix6<double> RectificationEstimator::nonlinearity_of(const MotionEvidence& motion,
                                                        const ErrorsDuring& errors) {
  const CameraErrors::Coefficients change = errors.coefficients() - motion.applied;
  if (!is_large(change)) return Matrix6<double>::Zero();
  const Vector6<double> error = CameraErrors::kNotFirstOrder * motion.derivative * change;
  return error * error.transpose();
}

Matrix6<double> RectificationEstimator::covariance_of(const MotionEvidence& motion) const {
  return covariance_of(motion, motion.derivative, errors_now());
}

Matrix6<double> RectificationEstimator::covariance_besides_scale(const MotionEvidence& motion,
                                                                 const Pose& T_first_second) const {
  return covariance_besides_scale(motion, T_first_second, errors_now());
}

Matrix6<double> RectificationEstimator::covariance_besides_scale(const MotionEvidence& motion,
                                                                 const Pose& T_first_second,
                                                                 const ErrorsDuring& errors) const {
  auto derivative = motion.derivative;
  derivative.bottomRows<3>() += T_first_second.inverse().translation() * scale_derivative().transpose();
  return covariance_of(motion, derivative, errors);
}

/// Covariance of a motion due to that of the errors, with this derivative with respect to the coefficients.
Matrix6<double> RectificationEstimator::covariance_of(const MotionEvidence& motion,
                                                      const MotionEvidence::Derivative& derivative,
                                                      const ErrorsDuring& errors) {
  Eigen::Matrix<double, 6, ErrorTerms::kBoth> by_errors;
  by_errors << derivative, motion.derivative_by_displacement;
  return by_errors * errors.covariance * by_errors.transpose();
}

MotionChange RectificationEstimator::correct(MotionEvidence& motion, const Pose& T_first_second,
                                             const History& history) const {
  const ErrorsDuring shown = errors_during(motion, history), errors = believed_during(motion, history);
  const ImageDisplacement::Coefficients displacement = errors.displacement();
  MotionChange result{
      .change = change_by(motion, errors.coefficients()) +
                motion.derivative_by_displacement * (displacement - motion.applied_displacement),
      .nonlinearity = nonlinearity_of(motion, shown)};
  if (motion.derivative.isZero(0.0) || motion.vibrates) return result;
  result.is_corrected = true;
  result.covariance_before = motion.covariance;
  result.covariance = covariance_besides_scale(motion, result.of(T_first_second), errors);
  motion.covariance = result.covariance;
  motion.applied = errors.coefficients();
  motion.applied_displacement = displacement;
  return result;
}

MotionChange RectificationEstimator::correct(const FrameDependence& frame, const MotionEvidence& motion,
                                             const Pose& T_first_frame, const History& history) const {
  if (motion.derivative.isZero(0.0)) return {};
  MotionEvidence to_frame = motion;
  to_frame.derivative = frame.derivative.cast<double>();
  to_frame.derivative_by_displacement.setZero();
  to_frame.derivative_by_delay = frame.derivative_by_delay.cast<double>();
  to_frame.covariance = frame.covariance.cast<double>();
  return correct(to_frame, T_first_frame, history);
}

}  // namespace stereo_slam
