// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/online_rectification.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "stereo_slam/core/median.hpp"

namespace stereo_slam {
namespace {

constexpr double kRowSigma_px = 0.3;
constexpr double kConfidence =
    0.25;  // weight of a keyframe's information on the disparity offset: its errors are not independent
constexpr double kCauchyScale2 = 6.0;  // squared Mahalanobis distance at which a weight halves

// Expected disparity offset for a given row offset: both have the same causes, such as a rotation of one
// camera, but one or the other may be small by chance.
constexpr double kDisparityPerRow = 2.0;
constexpr double kExactSigma_px = 0.03;  // of the disparity offset if there is no row offset

/// Powers of x and y of the terms.
constexpr std::array<std::array<int, 2>, RectificationResidual::kTerms> kPowers = {
    {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}, {3, 0}, {2, 1}, {1, 2}, {0, 3}}};

/// Mean square of an offset over the image, whose coordinates are uniform in [-1, 1].
[[nodiscard]] double mean_square(const RectificationResidual::Basis& c) {
  const auto mean = [](int power) { return power % 2 == 0 ? 1.0 / (power + 1) : 0.0; };
  double sum = 0.0;
  for (std::size_t i = 0; i < kPowers.size(); ++i) {
    for (std::size_t j = 0; j < kPowers.size(); ++j) {
      sum += c[static_cast<Eigen::Index>(i)] * c[static_cast<Eigen::Index>(j)] *
             mean(kPowers[i][0] + kPowers[j][0]) * mean(kPowers[i][1] + kPowers[j][1]);
    }
  }
  return sum;
}

/// Whether a change is too large for derivatives.
[[nodiscard]] bool is_large(const RectificationResidual::Basis& change) {
  return std::sqrt(mean_square(change)) >= DisparityOffset::kLargeChange_px;
}

/// A displacement and a roll of the right image: offsets in the rows, of the terms 1 and x.
struct RowFit {
  Vector2<double> offset_px = Vector2<double>::Zero();
  double median_residual_px = 0.0;
};

/// Iteratively reweighted least squares from the median on, as some pairs are wrong.
[[nodiscard]] RowFit fit_rows(std::span<const CornerPair> corners, const RectificationResidual& residual) {
  constexpr int kIterations = 10;
  constexpr double kLeastScale_px = 0.1;
  std::vector<double> rows_px;
  for (const auto& [left_px, right_px] : corners) {
    rows_px.push_back(static_cast<double>(right_px.y) - static_cast<double>(left_px.y));
  }
  RowFit fit{{median(rows_px), 0.0}};
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<Vector2<double>> terms;
    std::vector<double> distances_px;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vector2<double> left_px(corners[i].left_px.x, corners[i].left_px.y);
      terms.emplace_back(residual.basis(left_px).head<2>());
      distances_px.push_back(std::abs(rows_px[i] - terms.back().dot(fit.offset_px)));
    }
    fit.median_residual_px = median(distances_px);
    const double scale_px = std::max(fit.median_residual_px, kLeastScale_px);
    Matrix2<double> information = Matrix2<double>::Zero();
    Vector2<double> vector = Vector2<double>::Zero();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const double weight = 1.0 / (1.0 + std::pow(distances_px[i] / scale_px, 2));
      information += weight * terms[i] * terms[i].transpose();
      vector += weight * rows_px[i] * terms[i];
    }
    fit.offset_px = information.ldlt().solve(vector);
  }
  return fit;
}

/// The coefficients of an offset that a displacement amounts to, in the disparities and in the rows.
struct DisplacementTerms {
  using Terms = Eigen::Matrix<double, RectificationResidual::kTerms, ImageDisplacement::kTerms>;
  Terms disparity = Terms::Zero();
  Terms rows = Terms::Zero();

  explicit DisplacementTerms(const StereoCamera& camera) {
    const double x = 0.5 * camera.width_px / camera.fx, y = 0.5 * camera.height_px / camera.fy;
    disparity(0, 0) = rows(0, 1) = 1.0;
    disparity(2, 2) = -y;
    rows(1, 2) = x;
    disparity(3, 3) = x * x;
    rows(4, 3) = disparity(4, 4) = x * y;
    rows(5, 4) = y * y;
  }
};

/// Normal equations of a motion and of the coefficients of the disparity offset. If the rig vibrates, a
/// displacement of the second right image against the first is a further unknown.
struct MotionEquations {
  static constexpr int kBias = RectificationResidual::kTerms;
  static constexpr int kDisplacement = ImageDisplacement::kTerms;
  using PoseByBias = Eigen::Matrix<double, 6, kBias>;
  static constexpr double kUnknown_px = 10.0;  // standard deviation of the displacement

  Matrix6<double> pose_pose = Matrix6<double>::Zero();
  PoseByBias pose_bias = PoseByBias::Zero(), pose_second = PoseByBias::Zero();
  RectificationEstimate::Information bias_bias = RectificationEstimate::Information::Zero();
  Vector6<double> pose_vector = Vector6<double>::Zero();
  RectificationResidual::Basis bias_vector = RectificationResidual::Basis::Zero();

  ImageDisplacement::Covariance displacement =
      ImageDisplacement::Covariance::Identity() / (kUnknown_px * kUnknown_px);
  Eigen::Matrix<double, 6, kDisplacement> pose_displacement = Eigen::Matrix<double, 6, kDisplacement>::Zero();
  Eigen::Matrix<double, kBias, kDisplacement> bias_displacement =
      Eigen::Matrix<double, kBias, kDisplacement>::Zero();
  ImageDisplacement::Coefficients displacement_vector = ImageDisplacement::Coefficients::Zero();

  void add(const BiasConstraint& c, const RectificationResidual& residual, const StereoCamera* vibrating) {
    const RectificationResidual::Basis applied = residual.coefficients().row(0);
    Eigen::Matrix<double, 3, kBias> D = -c.J_disparity * residual.basis(c.first_px).transpose();
    const RectificationResidual::Basis second = residual.basis(c.second_px);
    D.row(2) += second.transpose();
    const double distance2 = c.innovation.dot(c.S_inverse * c.innovation);
    const Matrix3<double> W = c.S_inverse / (1.0 + distance2 / kCauchyScale2);
    // innovation - J_pose xi + D (bias - applied) should vanish
    const Vector3<double> e = c.innovation - D * applied;
    pose_pose += c.J_pose.transpose() * W * c.J_pose;
    pose_bias -= c.J_pose.transpose() * W * D;
    pose_second -= c.J_pose.transpose() * W.col(2) * second.transpose();
    bias_bias += D.transpose() * W * D;
    pose_vector += c.J_pose.transpose() * W * e;
    bias_vector -= D.transpose() * W * e;
    if (!vibrating) return;
    const Vector2<double> right_px(c.second_px.x() - c.second_disparity_px, c.second_px.y());
    const Eigen::Matrix<double, 1, kDisplacement> G = ImageDisplacement::basis(right_px, *vibrating).row(0);
    const Vector3<double> w = W.col(2);
    displacement += G.transpose() * W(2, 2) * G;
    pose_displacement -= c.J_pose.transpose() * w * G;
    bias_displacement += D.transpose() * w * G;
    displacement_vector -= G.transpose() * w.dot(e);
  }

  /// Solves for the displacement and eliminates it.
  void eliminate_displacement() {
    const ImageDisplacement::Covariance inverse =
        displacement.ldlt().solve(ImageDisplacement::Covariance::Identity());
    pose_pose -= pose_displacement * inverse * pose_displacement.transpose();
    pose_bias -= pose_displacement * inverse * bias_displacement.transpose();
    bias_bias -= bias_displacement * inverse * bias_displacement.transpose();
    pose_vector -= pose_displacement * inverse * displacement_vector;
    bias_vector -= bias_displacement * inverse * displacement_vector;
  }
};

}  // namespace

RectificationResidual::Basis RectificationResidual::basis(const Vector2<double>& left_px) const {
  const double x = 2.0 * (left_px.x() - camera_.cx) / camera_.width_px;
  const double y = 2.0 * (left_px.y() - camera_.cy) / camera_.height_px;
  Basis terms;
  terms << 1.0, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
  return terms;
}

Vector2<double> RectificationResidual::right_position(const StereoPoint& z) const {
  Vector2<double> right_px = Vector2<double>(z.x() - z.z(), z.y()) + coefficients_ * basis(z.head<2>());
  if (is_displaced_) right_px += ImageDisplacement::basis(right_px, camera_) * displacement_;
  return right_px;
}

Vector2<double> RectificationResidual::rms_offset_px() const {
  return {std::sqrt(mean_square(coefficients_.row(0).transpose())),
          std::sqrt(mean_square(coefficients_.row(1).transpose()))};
}

StereoMeasurement RectificationResidual::measure(const Vector2<double>& left_px,
                                                 const Vector2<double>& right_px) const {
  Vector2<double> difference = left_px - right_px + coefficients_ * basis(left_px);
  if (is_displaced_) {
    // The basis is that of the undisplaced position: the inverse of right_position(), to first order of what
    // is left.
    const Vector2<double> undisplaced_px =
        right_px - ImageDisplacement::basis(right_px, camera_) * displacement_;
    difference += ImageDisplacement::basis(undisplaced_px, camera_) * displacement_;
  }
  return {{left_px.x(), left_px.y(), difference.x()}, difference.y()};
}

RectificationEstimator::RectificationEstimator(const StereoCamera& camera,
                                               const OnlineRectificationSettings& settings)
    : camera_(camera), row_sigma_px_(settings.row_sigma_px), disparity_(settings.disparity_sigma_px) {
  rows_.information /= row_sigma_px_ * row_sigma_px_;
  expect_disparity_offset();
}

RectificationEstimator RectificationEstimator::resumed(const StereoCamera& camera,
                                                       const OnlineRectificationSettings& settings,
                                                       const RectificationEstimate& estimate) {
  RectificationEstimator estimator(camera, settings);
  estimator.coefficients_ = estimate.coefficients;
  estimator.rows_ = {estimate.row_information, estimate.row_vector};
  estimator.expect_disparity_offset();
  estimator.disparity_.resume({estimate.disparity_information, estimate.disparity_vector});
  return estimator;
}

RectificationEstimate RectificationEstimator::estimate() const {
  const auto& disparity = disparity_.everything();
  return {coefficients_, rows_.information, rows_.vector, disparity.information, disparity.vector};
}

void RectificationEstimator::add_rows(std::span<const StereoMeasurement> matches) {
  const RectificationResidual residual = current();
  for (const auto& match : matches) {
    const RectificationResidual::Basis terms = residual.basis(match.z.head<2>());
    const double offset = terms.dot(residual.coefficients().row(1)) - match.row_error_px;
    const double distance2 = match.row_error_px * match.row_error_px / (kRowSigma_px * kRowSigma_px);
    const double weight = 1.0 / (kRowSigma_px * kRowSigma_px * (1.0 + distance2 / kCauchyScale2));
    rows_.information += weight * terms * terms.transpose();
    rows_.vector += weight * offset * terms;
  }
}

bool RectificationEstimator::relearn_rows(std::span<const CornerPair> corners) {
  constexpr std::size_t kMinCorners = 50;
  constexpr double kMaxResidual_px = 0.3;  // the median; .03 to .24 on good pairs, .36 and more on late ones
  constexpr double kLeastChange_px = 1.0;  // smaller ones leave enough matches
  if (corners.size() < kMinCorners) return false;
  const RowFit fit = fit_rows(corners, current());
  RectificationResidual::Coefficients coefficients = coefficients_;
  coefficients.row(1).setZero();
  coefficients.row(1).head<2>() = fit.offset_px.transpose();
  const RectificationResidual change(camera_, coefficients - coefficients_);
  const bool agree = fit.median_residual_px <= kMaxResidual_px;
  if (!agree || !(change.rms_offset_px().y() >= kLeastChange_px)) return false;
  coefficients_ = coefficients;
  rows_.information = Information::Identity() / (row_sigma_px_ * row_sigma_px_);
  rows_.vector = rows_.information * coefficients_.row(1).transpose();
  expect_disparity_offset();
  return true;
}

RectificationEffect RectificationEstimator::add_motion(std::span<const BiasConstraint> constraints,
                                                       const Pose& T_first_second) {
  return add_motion(constraints, T_first_second, kConfidence);
}

RectificationEffect RectificationEstimator::add_motion_of_vibrating_rig(
    std::span<const BiasConstraint> constraints, const Pose& T_first_second,
    const ImageDisplacement::Covariance& displacement_covariance) {
  const RectificationEffect effect = add_motion(constraints, T_first_second, kConfidence, true);
  const auto terms = DisplacementTerms(camera_).disparity;
  disparity_.diffuse(terms * displacement_covariance * terms.transpose());
  return effect;
}

RectificationEffect RectificationEstimator::consider_motion(std::span<const BiasConstraint> constraints,
                                                            const Pose& T_first_second) {
  return add_motion(constraints, T_first_second, 0.0);
}

RectificationEffect RectificationEstimator::add_motion(std::span<const BiasConstraint> constraints,
                                                       const Pose& T_first_second, double confidence,
                                                       bool vibrates) {
  noticed_turn_ = false;
  constexpr std::size_t kMinConstraints = 30;
  if (constraints.size() < kMinConstraints) return {};
  MotionEquations sums;
  const RectificationResidual residual = current();
  for (const auto& c : constraints) sums.add(c, residual, vibrates ? &camera_ : nullptr);
  if (vibrates) sums.eliminate_displacement();
  const Eigen::LDLT<Matrix6<double>> factor(sums.pose_pose);
  constexpr double kMinReciprocalCondition = 1e-12;  // below, the motion itself is not known
  if (factor.info() != Eigen::Success || !factor.isPositive() || !(factor.rcond() > kMinReciprocalCondition))
    return {};
  const MotionEquations::PoseByBias pose_derivative = factor.solve(sums.pose_bias);
  RectificationEffect effect{
      .applied = coefficients_.row(0),
      .derivative = -pose_derivative,
      .derivative_by_second = -factor.solve(sums.pose_second),
      .vibrates = vibrates,
      .motion = motions_++,
      .evidence = {confidence * (sums.bias_bias - sums.pose_bias.transpose() * pose_derivative),
                   confidence * (sums.bias_vector - pose_derivative.transpose() * sums.pose_vector)}};
  effect.covariance = covariance_of(effect);
  noticed_turn_ = !vibrates && disparity_.add(effect.evidence);
  if (vibrates) disparity_.add_without_turn(effect.evidence);
  const Vector3<double> path_m = T_first_second.inverse().translation();
  length_derivative_m2_ += pose_derivative.bottomRows<3>().transpose() * path_m;
  squared_length_m2_ += path_m.squaredNorm();
  return effect;
}

/// Best estimate of the coefficients between the turns of the right camera before and after the motion.
RectificationResidual::Basis RectificationEstimator::estimate_of_period(
    const RectificationEffect& effect) const {
  const auto* period = disparity_.period_of(effect.motion);
  return period ? period->estimate.mean() : Basis(coefficients_.row(0));
}

RectificationResidual::Basis RectificationEstimator::disparity_offset_during(
    const RectificationEffect& effect) const {
  constexpr double kContradiction = 12.0;  // log of a likelihood ratio
  const Basis estimate = estimate_of_period(effect);
  const bool contradicts =
      is_large(estimate - effect.applied) &&
      effect.evidence.log_density(effect.applied) > effect.evidence.log_density(estimate) + kContradiction;
  return contradicts ? effect.applied : estimate;
}

Vector6<double> RectificationEstimator::change_of(const RectificationEffect& effect) const {
  return effect.derivative * (disparity_offset_during(effect) - effect.applied);
}

Matrix6<double> RectificationEstimator::nonlinearity_of(const RectificationEffect& effect) const {
  constexpr double kNotFirstOrder = 0.5;  // of the change, as seen when an offset of 1 to 5 px is learned
  const Basis change = estimate_of_period(effect) - effect.applied;
  if (!is_large(change)) return Matrix6<double>::Zero();
  const Vector6<double> error = kNotFirstOrder * effect.derivative * change;
  return error * error.transpose();
}

Matrix6<double> RectificationEstimator::covariance_of(const RectificationEffect& effect) const {
  return covariance_of(effect, effect.derivative);
}

Matrix6<double> RectificationEstimator::covariance_besides_scale(const RectificationEffect& effect,
                                                                 const Pose& T_first_second) const {
  if (disparity_.period_of(effect.motion)) return covariance_of(effect);
  auto derivative = effect.derivative;
  derivative.bottomRows<3>() += T_first_second.inverse().translation() * scale_derivative().transpose();
  return covariance_of(effect, derivative);
}

/// As covariance_of(), with another derivative of the motion with respect to the coefficients.
Matrix6<double> RectificationEstimator::covariance_of(const RectificationEffect& effect,
                                                      const MotionDerivative& derivative) const {
  const auto* period = disparity_.period_of(effect.motion);
  const Eigen::LDLT<Information> information((period ? period->estimate : disparity_.estimate()).information);
  Matrix6<double> covariance = derivative * information.solve(derivative.transpose());
  for (const auto& before : disparity_.periods()) {
    if (effect.motion + 1 != before.motions && effect.motion != before.motions) continue;
    const Vector6<double> change = effect.derivative_by_second * before.turn_px;
    covariance += change * change.transpose();
  }
  return covariance;
}

double RectificationEstimator::scale_sigma() const {
  const Basis derivative = scale_derivative();
  return std::sqrt(std::max(derivative.dot(disparity_.estimate().information.ldlt().solve(derivative)), 0.0));
}

/// Derivative of the scale of all lengths with respect to the coefficients. Zero before the first motion.
RectificationResidual::Basis RectificationEstimator::scale_derivative() const {
  if (!(squared_length_m2_ > 0.0)) return Basis::Zero();
  return length_derivative_m2_ / squared_length_m2_;
}

/// The prior of the disparity offset follows the row offset.
void RectificationEstimator::expect_disparity_offset() {
  disparity_.expect(std::hypot(kExactSigma_px, kDisparityPerRow * current().rms_offset_px().y()));
}

void RectificationEstimator::shift(const ImageDisplacement::Coefficients& displacement) {
  const DisplacementTerms terms(camera_);
  disparity_.shift(terms.disparity * displacement);
  rows_.vector += rows_.information * terms.rows * displacement;
}

void RectificationEstimator::advance() {
  coefficients_.row(1) = rows_.mean().transpose();
  expect_disparity_offset();
  coefficients_.row(0) = disparity_.estimate().mean().transpose();
}

}  // namespace stereo_slam
