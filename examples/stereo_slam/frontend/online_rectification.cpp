// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/online_rectification.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>

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

// Two errors hardly show in the rows: a wrong column of the right image (the term 1), and a right camera that
// is turned sideways (1 and x^2). They are believed to be large if that explains the motions much better: if
// the logarithm of the Bayes factor is above kLogEvidence. On recordings without them it is at most 1.4.
constexpr std::array kTermsUnseenInRows = {0, 3};
constexpr double kLogEvidence = 5.0;

/// Powers of x and y of the terms.
constexpr std::array<std::array<int, 2>, RectificationResidual::kTerms> kPowers = {
    {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}, {3, 0}, {2, 1}, {1, 2}, {0, 3}}};

[[nodiscard]] double squared_inverse(double x) { return 1.0 / (x * x); }

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

}  // namespace

RectificationResidual::Basis RectificationResidual::basis(const Vector2<double>& left_px) const {
  const double x = 2.0 * (left_px.x() - camera_.cx) / camera_.width_px;
  const double y = 2.0 * (left_px.y() - camera_.cy) / camera_.height_px;
  Basis terms;
  terms << 1.0, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
  return terms;
}

Vector2<double> RectificationResidual::right_position(const StereoPoint& z) const {
  return Vector2<double>(z.x() - z.z(), z.y()) + coefficients_ * basis(z.head<2>());
}

Vector2<double> RectificationResidual::rms_offset_px() const {
  return {std::sqrt(mean_square(coefficients_.row(0).transpose())),
          std::sqrt(mean_square(coefficients_.row(1).transpose()))};
}

RectificationResidual::Measurement RectificationResidual::measure(const Vector2<double>& left_px,
                                                                  const Vector2<double>& right_px) const {
  const Vector2<double> difference = left_px - right_px + coefficients_ * basis(left_px);
  return {{left_px.x(), left_px.y(), difference.x()}, difference.y()};
}

RectificationEstimator::RectificationEstimator(const StereoCamera& camera,
                                               const OnlineRectificationSettings& settings)
    : camera_(camera), max_disparity_sigma_px_(settings.disparity_sigma_px) {
  estimate_.row_information /= settings.row_sigma_px * settings.row_sigma_px;
  estimate_.disparity_information /= settings.disparity_sigma_px * settings.disparity_sigma_px;
}

RectificationEstimator RectificationEstimator::resumed(const StereoCamera& camera,
                                                       const OnlineRectificationSettings& settings,
                                                       const RectificationEstimate& estimate) {
  RectificationEstimator estimator(camera, settings);
  estimator.estimate_ = estimate;
  return estimator;
}

void RectificationEstimator::add_rows(std::span<const RectificationResidual::Measurement> matches) {
  const RectificationResidual residual = current();
  for (const auto& match : matches) {
    const RectificationResidual::Basis terms = residual.basis(match.z.head<2>());
    const double offset = terms.dot(residual.coefficients().row(1)) - match.row_error_px;
    const double distance2 = match.row_error_px * match.row_error_px / (kRowSigma_px * kRowSigma_px);
    const double weight = 1.0 / (kRowSigma_px * kRowSigma_px * (1.0 + distance2 / kCauchyScale2));
    estimate_.row_information += weight * terms * terms.transpose();
    estimate_.row_vector += weight * offset * terms;
  }
}

RectificationEffect RectificationEstimator::add_motion(std::span<const BiasConstraint> constraints,
                                                       const Pose& T_first_second) {
  constexpr std::size_t kMinConstraints = 30;
  if (constraints.size() < kMinConstraints) return {};
  Matrix6<double> pose_pose = Matrix6<double>::Zero();
  using PoseByBias = Eigen::Matrix<double, 6, RectificationResidual::kTerms>;
  PoseByBias pose_bias = PoseByBias::Zero();
  Information bias_bias = Information::Zero();
  Vector6<double> pose_vector = Vector6<double>::Zero();
  Basis bias_vector = Basis::Zero();
  const RectificationResidual residual = current();
  const Basis applied = residual.coefficients().row(0);
  for (const auto& c : constraints) {
    Eigen::Matrix<double, 3, RectificationResidual::kTerms> D =
        -c.J_disparity * residual.basis(c.first_px).transpose();
    D.row(2) += residual.basis(c.second_px).transpose();
    const double distance2 = c.innovation.dot(c.S_inverse * c.innovation);
    const Matrix3<double> W = c.S_inverse / (1.0 + distance2 / kCauchyScale2);
    // innovation - J_pose xi + D (bias - applied) should vanish
    const Vector3<double> e = c.innovation - D * applied;
    pose_pose += c.J_pose.transpose() * W * c.J_pose;
    pose_bias -= c.J_pose.transpose() * W * D;
    bias_bias += D.transpose() * W * D;
    pose_vector += c.J_pose.transpose() * W * e;
    bias_vector -= D.transpose() * W * e;
  }
  const Eigen::LDLT<Matrix6<double>> factor(pose_pose);
  constexpr double kMinReciprocalCondition = 1e-12;  // below, the motion itself is not known
  if (factor.info() != Eigen::Success || !factor.isPositive() || !(factor.rcond() > kMinReciprocalCondition))
    return {};
  const PoseByBias pose_derivative = factor.solve(pose_bias);
  RectificationEffect effect{.applied = applied, .derivative = -pose_derivative};
  effect.covariance = covariance_of(effect);
  estimate_.disparity_information += kConfidence * (bias_bias - pose_bias.transpose() * pose_derivative);
  estimate_.disparity_vector += kConfidence * (bias_vector - pose_derivative.transpose() * pose_vector);
  const Vector3<double> path_m = T_first_second.inverse().translation();
  length_derivative_m2_ += pose_derivative.bottomRows<3>().transpose() * path_m;
  squared_length_m2_ += path_m.squaredNorm();
  return effect;
}

/// Information on the coefficients of the disparity offset, 1/px^2. The standard deviation of their prior
/// follows the row offset, unless the motions contradict it.
RectificationEstimate::Information RectificationEstimator::disparity_information() const {
  const double expected_px = std::hypot(kExactSigma_px, kDisparityPerRow * current().rms_offset_px().y());
  const double widest = squared_inverse(max_disparity_sigma_px_);  // is in the estimate
  const Basis usual_prior = Basis::Constant(std::max(squared_inverse(expected_px), widest));
  Basis wide_prior = usual_prior;
  for (const int term : kTermsUnseenInRows) wide_prior[term] = widest;
  const auto posterior = [&](const Basis& prior) -> Information {
    return estimate_.disparity_information + Information((prior - Basis::Constant(widest)).asDiagonal());
  };
  const auto log_evidence = [&](const Basis& prior) {  // up to a constant
    const Eigen::LDLT<Information> factor(posterior(prior));
    const Basis& v = estimate_.disparity_vector;
    return 0.5 * (v.dot(factor.solve(v)) + (prior.array() / factor.vectorD().array()).log().sum());
  };
  const bool is_contradicted = log_evidence(wide_prior) - log_evidence(usual_prior) > kLogEvidence;
  return posterior(is_contradicted ? wide_prior : usual_prior);
}

Matrix6<double> RectificationEstimator::covariance_of(const RectificationEffect& effect) const {
  const Eigen::LDLT<Information> information(disparity_information());
  return effect.derivative * information.solve(effect.derivative.transpose());
}

double RectificationEstimator::scale_sigma() const {
  if (!(squared_length_m2_ > 0.0)) return 0.0;
  const Basis derivative = length_derivative_m2_ / squared_length_m2_;
  return std::sqrt(std::max(derivative.dot(disparity_information().ldlt().solve(derivative)), 0.0));
}

void RectificationEstimator::advance() {
  const auto& e = estimate_;
  estimate_.coefficients.row(1) = e.row_information.ldlt().solve(e.row_vector).transpose();
  estimate_.coefficients.row(0) = disparity_information().ldlt().solve(e.disparity_vector).transpose();
}

}  // namespace stereo_slam
