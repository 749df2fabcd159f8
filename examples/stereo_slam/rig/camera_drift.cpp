// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/camera_drift.hpp"

#include <cmath>

#include <Eigen/Cholesky>

namespace stereo_slam {
namespace {

constexpr int kCoefficients = ErrorTerms::kAll;
constexpr int kDisplaced = ImageDisplacement::kTerms;
using Evidence = ErrorTerms::Evidence;
using EvidenceOfBoth = ErrorTerms::EvidenceOfBoth;
using Both = antipode::Matrix<double, ErrorTerms::kBoth>;

/// What is known of the errors and of a displacement that is known to a standard deviation.
[[nodiscard]] EvidenceOfBoth with_displacement(const Evidence& errors, double sigma_px) {
  EvidenceOfBoth result;
  result.information.topLeftCorner<kCoefficients, kCoefficients>() = errors.information;
  result.information.diagonal().tail<kDisplaced>().setConstant(1.0 / (sigma_px * sigma_px));
  result.vector.head<kCoefficients>() = errors.vector;
  return result;
}

/// What is known of the errors after the displacement.
[[nodiscard]] Evidence displaced(const EvidenceOfBoth& before,
                                 const ErrorTerms::ByDisplacement& by_displacement) {
  Both back = Both::Identity();  // (errors after, displacement) -> (errors before, displacement)
  back.topRightCorner<kCoefficients, kDisplaced>() = -by_displacement;
  const Both information = back.transpose() * before.information * back;
  const auto vector = (back.transpose() * before.vector).eval();
  const Eigen::Matrix<double, kCoefficients, kDisplaced> cross =
      information.topRightCorner<kCoefficients, kDisplaced>();
  const Eigen::LDLT<ImageDisplacement::Covariance> inner(
      information.bottomRightCorner<kDisplaced, kDisplaced>());
  return {information.topLeftCorner<kCoefficients, kCoefficients>() - cross * inner.solve(cross.transpose()),
          vector.head<kCoefficients>() - cross * inner.solve(vector.tail<kDisplaced>())};
}

[[nodiscard]] Evidence changed(const Evidence& before, const ErrorChange& change) {
  Evidence after = change.covariance.isZero(0.0) ? before : widened(before, change.covariance);
  after.vector += after.information * change.shift;
  return after;
}

/// Mean and covariance of errors and displacement, which is zero for a rigid rig.
[[nodiscard]] ErrorsDuring moments(const Evidence& known, const EvidenceOfBoth& motion, double sigma_px) {
  ErrorsDuring result;
  if (sigma_px > 0.0) {
    const EvidenceOfBoth all = with_displacement(known, sigma_px) + motion;
    result = {all.mean(), all.covariance()};
  } else {
    const Evidence all = known + of_rigid_rig(motion);
    result.mean.head<kCoefficients>() = all.mean();
    result.covariance.topLeftCorner<kCoefficients, kCoefficients>() = all.covariance();
  }
  return result;
}

/// Goes back over a motion and the change after it: makes of the errors during a motion, as it and those
/// before it tell them, those that all motions tell. `next` is what these tell of the errors after the
/// change.
[[nodiscard]] ErrorsDuring smoothed(const ErrorsDuring& told, double sigma_px, const ErrorChange& change,
                                    const ErrorTerms::ByDisplacement& by_displacement,
                                    const ErrorsDuring& next) {
  ErrorsDuring result = told;
  const ErrorTerms::Coefficients mean = next.coefficients() - change.shift;
  const ErrorTerms::Covariance covariance = next.covariance.topLeftCorner<kCoefficients, kCoefficients>();
  if (sigma_px == 0.0 && change.covariance.isZero(0.0)) {  // nothing else changed
    result.mean.head<kCoefficients>() = mean;
    result.covariance.topLeftCorner<kCoefficients, kCoefficients>() = covariance;
    return result;
  }
  Eigen::Matrix<double, kCoefficients, ErrorTerms::kBoth> to_next;
  to_next << ErrorTerms::Covariance::Identity(), by_displacement;
  const Eigen::Matrix<double, ErrorTerms::kBoth, kCoefficients> cross = told.covariance * to_next.transpose();
  const ErrorTerms::Covariance predicted = to_next * cross + change.covariance;
  const Eigen::Matrix<double, ErrorTerms::kBoth, kCoefficients> gain =
      predicted.ldlt().solve(cross.transpose()).transpose();
  result.mean += gain * (mean - to_next * told.mean);
  result.covariance += gain * (covariance - predicted) * gain.transpose();
  return result;
}

/// Mean and covariance of errors alone.
[[nodiscard]] ErrorsDuring moments(const Evidence& known) { return moments(known, EvidenceOfBoth{}, 0.0); }

}  // namespace

DisplacementTerms::DisplacementTerms(const StereoCamera& camera) {
  const double x = 0.5 * camera.width_px / camera.fx, y = 0.5 * camera.height_px / camera.fy;
  disparity(0, 0) = rows(0, 1) = 1.0;
  disparity(2, 2) = -y;
  rows(1, 2) = x;
  disparity(3, 3) = x * x;
  rows(4, 3) = disparity(4, 4) = x * y;
  rows(5, 4) = y * y;
}

double DriftHypothesis::log_likelihood_of(const EvidenceOfBoth& motion, const Evidence& known) const {
  return sigma_px_ > 0.0 ? with_displacement(known, sigma_px_).log_evidence(motion)
                         : known.log_evidence(of_rigid_rig(motion));
}

void DriftHypothesis::add(const EvidenceOfBoth& motion, double log_likelihood) {
  constexpr double kImpossible = -1e3;  // what is not finite could not be computed
  log_likelihood_ += std::isfinite(log_likelihood) ? log_likelihood : kImpossible;
  sigmas_px_.push_back(static_cast<float>(sigma_px_));
  if (sigma_px_ > 0.0) {
    everything_ = displaced(with_displacement(everything_, sigma_px_) + motion, by_displacement_);
    spread_px2_ += sigma_px_ * sigma_px_ * by_displacement_ * by_displacement_.transpose();
  } else {
    everything_ = everything_ + of_rigid_rig(motion);
  }
}

void DriftHypothesis::add_displaced(const Evidence& motion) {
  everything_ = everything_ + motion;
  sigmas_px_.push_back(0.0F);
}

void DriftHypothesis::change(const ErrorChange& change) {
  everything_ = changed(everything_, change);
  if (!change.only_forgets) spread_px2_ += change.covariance;
}

void DriftHypothesis::continue_from(const DriftHypothesis& likelier, double log_factor) {
  everything_ = likelier.everything_;
  spread_px2_ = likelier.spread_px2_;
  sigmas_px_ = likelier.sigmas_px_;
  log_likelihood_ = likelier.log_likelihood_ - log_factor;
}

std::vector<ErrorsDuring> smoothed_errors(std::span<const EvidenceOfBoth> motions,
                                          std::span<const float> drift_sigmas_px,
                                          std::span<const ErrorChange> changes,
                                          const ErrorTerms::ByDisplacement& by_displacement,
                                          const Evidence& begin, const Evidence& end) {
  std::vector<ErrorChange> after(motions.size());  // each motion: all changes together
  std::vector<ErrorsDuring> result;
  Evidence known = begin;
  bool is_constant = true;
  auto change = changes.begin();
  for (; change != changes.end() && change->motions == 0; ++change) known = changed(known, *change);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    DriftHypothesis step(static_cast<double>(drift_sigmas_px[i]), by_displacement, known);
    is_constant = is_constant && step.sigma_px() == 0.0;
    result.push_back(moments(known, motions[i], step.sigma_px()));
    step.add(motions[i], 0.0);
    for (; change != changes.end() && change->motions == i + 1; ++change) {
      step.change(*change);
      if (change->only_forgets) continue;
      after[i].shift += change->shift;
      after[i].covariance += change->covariance;
      is_constant = false;
    }
    known = step.everything();
  }
  ErrorsDuring next = moments(is_constant ? end : known);
  for (std::size_t i = motions.size(); i-- > 0;)
    next = result[i] =
        smoothed(result[i], static_cast<double>(drift_sigmas_px[i]), after[i], by_displacement, next);
  return result;
}

}  // namespace stereo_slam
