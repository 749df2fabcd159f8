// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/rectification_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "stereo_slam/core/pixel_noise.hpp"

namespace stereo_slam {
namespace {

// Expected disparity offset for a given row offset: both have the same causes, such as a rotation of one
// camera, but one or the other may be small by chance.
constexpr double kDisparityPerRow = 2.0;
constexpr double kExactSigma_px = 0.03;  // of a coefficient if there is no row offset
constexpr std::size_t kMinCorners = 50;  // for a displacement and a roll of the rows

/// Whether a change is too large for derivatives.
[[nodiscard]] bool is_large(const CameraErrors::Coefficients& change) {
  return PairGeometry::rms(change.head<PairGeometry::kTerms>()) >= CameraErrors::kLargeChange_px;
}

}  // namespace

RectificationEstimator::RectificationEstimator(const StereoCamera& camera,
                                               const OnlineRectificationSettings& settings)
    : camera_(camera),
      row_sigma_px_(settings.row_sigma_px),
      delay_(settings.row_sigma_px),
      disparity_(settings.disparity_sigma_px, DisplacementTerms(camera).disparity) {
  rows_.information /= row_sigma_px_ * row_sigma_px_;
  expect_disparity_offset();
}

RectificationEstimator RectificationEstimator::resumed(const StereoCamera& camera,
                                                       const OnlineRectificationSettings& settings,
                                                       const RectificationEstimate& estimate) {
  RectificationEstimator estimator(camera, settings);
  estimator.coefficients_ = estimate.coefficients;
  estimator.lens_ = estimate.lens;
  estimator.rows_ = {estimate.row_information, estimate.row_vector};
  estimator.expect_disparity_offset();
  estimator.disparity_.resume({estimate.disparity_information, estimate.disparity_vector},
                              estimate.has_large_error);
  if (estimate.delay) estimator.delay_.begin_with(*estimate.delay);
  return estimator;
}

RectificationEstimator RectificationEstimator::after_drift(const StereoCamera& camera,
                                                           const OnlineRectificationSettings& settings,
                                                           const RectificationEstimate& estimate) {
  // Between KITTI 00 and 01, two drives with one calibration, the rows have shifted by .36 px and the
  // disparities by .9 px: root mean square .7 px.
  constexpr double kDrift_px = 0.7;
  const ImageDisplacement::Covariance drift =
      kDrift_px * kDrift_px * ImageDisplacement::Covariance::Identity();
  const DisplacementTerms terms(camera);
  RectificationEstimator estimator = resumed(camera, settings, estimate);
  estimator.disparity_.resume({estimate.disparity_information, estimate.disparity_vector},
                              estimate.has_large_error,
                              terms.disparity * drift * terms.disparity.transpose());
  const RectificationEstimate::Information of_rows = terms.rows * drift * terms.rows.transpose();
  estimator.rows_ = widened(estimator.rows_, of_rows);
  estimator.learned_rows_ = estimator.rows_;
  return estimator;
}

bool RectificationEstimator::contradicts_learned() const {
  if (!learned_rows_) return rows_contradict_learned_;
  const RowInformation nothing_known{
      RectificationEstimate::Information::Identity() / (row_sigma_px_ * row_sigma_px_),
      RectificationEstimate::Basis::Zero()};
  const auto since = rows_ - *learned_rows_;
  return nothing_known.log_evidence(since) > learned_rows_->log_evidence(since);
}

RectificationEstimate RectificationEstimator::estimate() const {
  const auto& disparity = disparity_.everything();
  return {coefficients_,    lens_,   rows_.information,           rows_.vector, disparity.information,
          disparity.vector, delay(), disparity_.has_large_error()};
}

LensEstimate RectificationEstimator::lens_error() const {
  const LensResidual::Coefficients mean_px = disparity_.estimate().mean().tail<LensResidual::kTerms>();
  const LensResidual::Coefficients sigma_px = lens_covariance().diagonal().cwiseMax(0.0).cwiseSqrt();
  return {LensResidual(camera_, mean_px).k(), LensResidual(camera_, sigma_px).k()};
}

Matrix2<double> RectificationEstimator::lens_covariance() const {
  constexpr int kLens = LensResidual::kTerms;
  const CameraErrors::Information covariance =
      disparity_.estimate().information.ldlt().solve(CameraErrors::Information::Identity());
  return covariance.bottomRightCorner<kLens, kLens>();
}

void RectificationEstimator::add_rows(std::span<const StereoMeasurement> matches) {
  const PairGeometry geometry = current();
  for (const auto& match : matches) {
    const PairGeometry::Basis terms = geometry.basis(match.left_px);
    const double offset = terms.dot(geometry.coefficients().row(1)) - match.row_error_px;
    const double distance2 = match.row_error_px * match.row_error_px / (kRowSigma_px * kRowSigma_px);
    const double weight = kOutlierLoss.weight(distance2, 1) / (kRowSigma_px * kRowSigma_px);
    rows_.information += weight * terms * terms.transpose();
    rows_.vector += weight * offset * terms;
  }
  coefficients_.row(1) = rows_.mean().transpose();
}

void RectificationEstimator::add_delay(std::span<const StereoMeasurement> matches, const LateMotion& motion) {
  delay_.add(matches, current(), motion, camera_);
}

std::optional<ImageDisplacement::Coefficients> RectificationEstimator::displacement_of_rows(
    std::span<const CornerPair> corners) const {
  constexpr double kMaxResidual_px = 2.0;  // the median: as far as stereo matches are searched beside rows
  if (corners.size() < kMinCorners) return std::nullopt;
  const RobustLine fit = current().fit_rows(corners);
  if (!(fit.median_residual <= kMaxResidual_px)) return std::nullopt;
  const Vector2<double> change_px =
      Vector2<double>(fit.offset, fit.slope) - coefficients_.row(1).head<2>().transpose();
  ImageDisplacement::Coefficients displacement = ImageDisplacement::Coefficients::Zero();
  displacement[1] = change_px[0];
  displacement[2] = change_px[1] / DisplacementTerms(camera_).rows(1, 2);
  return displacement;
}

bool RectificationEstimator::relearn_rows(std::span<const CornerPair> corners) {
  constexpr double kMaxResidual_px = 0.3;  // the median; .03 to .24 on good pairs, .36 and more on late ones
  constexpr double kLeastChange_px = 1.0;  // smaller ones leave enough matches
  if (corners.size() < kMinCorners) return false;
  const RobustLine fit = current().fit_rows(corners);
  PairGeometry::Coefficients coefficients = coefficients_;
  coefficients.row(1).setZero();
  coefficients.row(1).head<2>() << fit.offset, fit.slope;
  const PairGeometry change(camera_, coefficients - coefficients_);
  const bool agree = fit.median_residual <= kMaxResidual_px;
  if (!agree || !(change.rms_offset_px().y() >= kLeastChange_px)) return false;
  rows_contradict_learned_ = rows_contradict_learned_ || learned_rows_;
  learned_rows_.reset();
  coefficients_ = coefficients;
  rows_.information = RectificationEstimate::Information::Identity() / (row_sigma_px_ * row_sigma_px_);
  rows_.vector = rows_.information * coefficients_.row(1).transpose();
  expect_disparity_offset();
  return true;
}

MotionEvidence RectificationEstimator::add_motion(const SeenMotion& motion) {
  return add_motion(motion, kEvidenceWeight);
}

MotionEvidence RectificationEstimator::add_motion_of_vibrating_rig(
    const SeenMotion& motion, const ImageDisplacement::Covariance& displacement_covariance) {
  MotionEvidence shown = add_motion(motion, kEvidenceWeight, true);
  const auto terms = DisplacementTerms(camera_).disparity;
  disparity_.diffuse(terms * displacement_covariance * terms.transpose());
  return shown;
}

MotionEvidence RectificationEstimator::consider_motion(const SeenMotion& motion) {
  return add_motion(motion, 0.0);
}

MotionEvidence RectificationEstimator::add_motion(const SeenMotion& motion, double confidence,
                                                  bool vibrates) {
  auto shown = measured(motion, vibrates);
  if (!shown) return {};
  ++motions_;
  shown->evidence = {confidence * shown->evidence.information, confidence * shown->evidence.vector};
  if (!vibrates && motion.late.empty()) {
    disparity_.add(shown->evidence, applied());
    displace_rows(disparity_.drift_sigma_px());
  } else {
    disparity_.add_displaced(shown->evidence);
  }
  const Vector3<double> path_m = motion.T_first_second.inverse().translation();
  length_derivative_m2_ -= shown->derivative.bottomRows<3>().transpose() * path_m;
  squared_length_m2_ += path_m.squaredNorm();
  return *std::move(shown);
}

/// The right image may have been displaced by this in each coefficient since the rows were measured.
void RectificationEstimator::displace_rows(double sigma_px) {
  if (!(sigma_px > 0.0)) return;
  const auto terms = DisplacementTerms(camera_).rows;
  const RectificationEstimate::Information change = sigma_px * sigma_px * terms * terms.transpose();
  rows_ = widened(rows_, change);
}

/// What a motion shows, which is measured with the coefficients and the delay in use.
std::optional<MotionEvidence> RectificationEstimator::measured(const SeenMotion& motion,
                                                               bool vibrates) const {
  constexpr std::size_t kMinPoints = 30;
  if (motion.points.size() < kMinPoints) return std::nullopt;
  auto shown = evidence_of_motion(motion, current(), applied(), camera_, vibrates);
  if (!shown) return std::nullopt;
  shown->applied_delay_s = used_delay().seconds;
  shown->motion = motions_;
  shown->covariance = covariance_of(*shown);
  return shown;
}

std::optional<FrameDependence> RectificationEstimator::dependence_of(const SeenMotion& motion,
                                                                     bool vibrates) const {
  const auto shown = measured(motion, vibrates);
  if (!shown) return std::nullopt;
  return FrameDependence{shown->derivative.cast<float>(), shown->derivative_by_delay.cast<float>(),
                         shown->covariance.cast<float>()};
}

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

/// The coefficients in use.
CameraErrors::Coefficients RectificationEstimator::applied() const {
  CameraErrors::Coefficients result;
  result << coefficients_.row(0).transpose(), lens_;
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

double RectificationEstimator::scale_sigma() const {
  const CameraErrors::Coefficients derivative = scale_derivative();
  return std::sqrt(std::max(derivative.dot(disparity_.estimate().information.ldlt().solve(derivative)), 0.0));
}

/// Derivative of the scale of all lengths with respect to the coefficients. Zero before the first motion.
CameraErrors::Coefficients RectificationEstimator::scale_derivative() const {
  if (!(squared_length_m2_ > 0.0)) return CameraErrors::Coefficients::Zero();
  return length_derivative_m2_ / squared_length_m2_;
}

/// Root mean square of the row offset without a shift and a roll of the image, which say nothing of its lens,
/// and without what its noise adds.
double RectificationEstimator::bent_rows_px() const {
  const auto bent_px = [](PairGeometry::Basis rows) {
    rows.head<2>().setZero();
    return PairGeometry::rms(rows);
  };
  using Information = RectificationEstimate::Information;
  const Information covariance = rows_.information.ldlt().solve(Information::Identity());
  const Information factor = covariance.llt().matrixL();
  double noise2 = 0.0;
  for (int i = 0; i < factor.cols(); ++i) noise2 += std::pow(bent_px(factor.col(i)), 2);
  return std::sqrt(std::max(std::pow(bent_px(coefficients_.row(1)), 2) - noise2, 0.0));
}

/// The priors of the disparity offset and of the lenses follow the row offset.
void RectificationEstimator::expect_disparity_offset() {
  disparity_.expect(
      std::hypot(kExactSigma_px, kDisparityPerRow * current().rms_offset_px().y()),
      std::hypot(kExactSigma_px, CameraErrors::kLensPerOffset * kDisparityPerRow * bent_rows_px()));
}

void RectificationEstimator::shift(const ImageDisplacement::Coefficients& displacement) {
  const DisplacementTerms terms(camera_);
  disparity_.shift(terms.disparity * displacement);
  rows_.vector += rows_.information * terms.rows * displacement;
}

void RectificationEstimator::begin_displaced(const Vector2<double>& displacement,
                                             const Matrix2<double>& covariance) {
  Eigen::Matrix<double, CameraErrors::kTerms, 2> terms;
  const DisplacementTerms all(camera_);
  terms << all.disparity.col(0), all.disparity.col(3);
  disparity_.begin_with(terms * displacement, terms * covariance * terms.transpose());
  advance();
}

void RectificationEstimator::advance() {
  delay_.advance();
  coefficients_.row(1) = rows_.mean().transpose();
  expect_disparity_offset();
  const CameraErrors::Coefficients mean = disparity_.estimate().mean();
  coefficients_.row(0) = mean.head<PairGeometry::kTerms>().transpose();
  const LensResidual lens(camera_, mean.tail<LensResidual::kTerms>());
  if (lens.is_moderate()) lens_ = lens.coefficients();
}

}  // namespace stereo_slam
