// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/camera_errors.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace stereo_slam {
namespace {

using Coefficients = CameraErrors::Coefficients;
using Evidence = CameraErrors::Evidence;
using Information = CameraErrors::Information;

// The errors that hardly show in the rows: 1 for a wrong column, 1 and x^2 for a turn.
constexpr std::array kUnseenTerms = {0, 3};

// Least logarithm of the Bayes factor of a large error. On undisturbed recordings, real and rendered, it is
// at most 1.4.
constexpr double kLargeErrorEvidence = 5.0;
constexpr double kTurnSigma_px = 1.0;

// From keyframe to keyframe, px: a rigid rig, one that is displaced by a pixel in a hundred thousand, ten
// thousand or a thousand keyframes, and one that vibrates by less than is noticed.
constexpr std::array kDriftSigmas_px = {0.0, 0.003, 0.01, 0.03, 0.1};
// Least logarithm of the likelihood ratio of a drift, which is one number more, to a rigid rig (Akaike).
constexpr double kDriftEvidence = 1.0;
// How much less likely a hypothesis becomes at most, as a logarithm. A larger number notices a change of the
// rig later.
constexpr double kRefuted = 10.0;

[[nodiscard]] double squared_inverse(double x) { return 1.0 / (x * x); }

/// Information of a prior, from standard deviations.
[[nodiscard]] Coefficients prior_of(double offset_sigma_px, double lens_sigma_px) {
  Coefficients prior = Coefficients::Constant(squared_inverse(offset_sigma_px));
  prior.tail<LensResidual::kTerms>().setConstant(squared_inverse(lens_sigma_px));
  return prior;
}

/// A turn sideways of the right camera.
[[nodiscard]] Information turn_sideways(double sigma_px) {
  Information turn = Information::Zero();
  for (const int term : kUnseenTerms) turn(term, term) = sigma_px * sigma_px;
  return turn;
}

/// The evidence of a motion that was measured with coefficients that were wrong by `change`: its derivatives
/// are inexact.
[[nodiscard]] CameraErrors::EvidenceOfBoth as_exact_as_first_order(CameraErrors::EvidenceOfBoth motion,
                                                                   const Coefficients& change) {
  antipode::Vector<double, CameraErrors::kBoth> error = decltype(error)::Zero();
  for (const int term : kUnseenTerms) error[term] = CameraErrors::kNotFirstOrder * change[term];
  const antipode::Vector<double, CameraErrors::kBoth> by_error = motion.information * error;
  const double shrink = 1.0 / (1.0 + error.dot(by_error));
  motion.vector -= shrink * error.dot(motion.vector) * by_error;
  motion.information -= shrink * by_error * by_error.transpose();
  return motion;
}

[[nodiscard]] Evidence diagonal(const Coefficients& information) {
  return {Information(information.asDiagonal()), Coefficients::Zero()};
}

}  // namespace

CameraErrors::CameraErrors(double widest_sigma_px, const ByDisplacement& by_displacement)
    : by_displacement_(by_displacement),
      widest_prior_(prior_of(widest_sigma_px, kLensPerOffset * widest_sigma_px)),
      usual_prior_(widest_prior_),
      large_error_prior_(widest_prior_) {
  begin_hypotheses(diagonal(widest_prior_));
}

void CameraErrors::begin_hypotheses(const Evidence& everything) {
  usual_ = {};
  for (const double sigma_px : kDriftSigmas_px)
    usual_.hypotheses.emplace_back(sigma_px, by_displacement_, everything);
  large_error_ = usual_;
}

void CameraErrors::resume(const Evidence& everything, bool has_large_error, const Information& drift) {
  begin_ = everything;
  if (!drift.isZero(0.0)) {
    begin_ = widened(everything, drift);
    fresh_ = {DriftHypothesis(0.0, by_displacement_, diagonal(widest_prior_)), 0.0};
  }
  begin_hypotheses(*begin_);
  has_large_error_ = has_large_error || evidence_of_large_error(used()) > kLargeErrorEvidence;
  notice_lens_error();
}

void CameraErrors::expect(double offset_sigma_px, double lens_sigma_px) {
  usual_prior_ = widest_prior_.cwiseMax(prior_of(offset_sigma_px, lens_sigma_px));
  if (has_lens_error_) allow_lens_error(usual_prior_);
  large_error_prior_ = usual_prior_;
  for (const int term : kUnseenTerms) large_error_prior_[term] = widest_prior_[term];
}

void CameraErrors::allow_lens_error(Coefficients& prior) const {
  prior.tail<LensResidual::kTerms>() = widest_prior_.tail<LensResidual::kTerms>();
}

/// Drops what another one had learned, if all motions since are likelier with the widest prior alone;
/// `before` is what was known before this motion.
void CameraErrors::check_learned(const EvidenceOfBoth& motion, const DriftHypothesis& before) {
  if (!fresh_) return;
  auto& [fresh, log_factor] = *fresh_;
  const double without = fresh.log_likelihood_of(motion, fresh.everything());
  log_factor += without - before.log_likelihood_of(motion, before.everything());
  fresh.add(motion, without);
  if (log_factor <= 0.0) return;
  begin_hypotheses(fresh.everything());
  for (auto* alternative : {&usual_, &large_error_})
    for (auto& hypothesis : alternative->hypotheses) hypothesis.continue_from(fresh, fresh.log_likelihood());
  begin_.reset();
  fresh_.reset();
  dropped_learned_ = true;
  has_lens_error_ = false;
  has_large_error_ = evidence_of_large_error(usual_.used()) > kLargeErrorEvidence;
}

void CameraErrors::add_to(Alternative& alternative, const Coefficients& prior,
                          const EvidenceOfBoth& motion) const {
  for (auto& hypothesis : alternative.hypotheses) {
    const Evidence known = fresh_ ? hypothesis.everything() : with_prior(hypothesis, prior);
    hypothesis.add(motion, hypothesis.log_likelihood_of(motion, known));
  }
  // An error that is still being learned looks like a drift: the first motions were measured without it.
  alternative.select(&alternative == &large_error_ ? kLargeErrorEvidence : kDriftEvidence);
}

void CameraErrors::add(const EvidenceOfBoth& shown, const Coefficients& applied) {
  const DriftHypothesis before = used();
  EvidenceOfBoth motion = shown;
  if (has_large_error_)
    motion = as_exact_as_first_order(shown, (estimate() + of_rigid_rig(shown)).mean() - applied);
  motions_.push_back(motion);
  add_to(usual_, usual_prior_, motion);
  add_to(large_error_, large_error_prior_, motion);
  check_learned(motion, before);
  notice_large_error();
  notice_lens_error();
}

/// Notices a large error that was there from the start, if the motions are much likelier with it than with a
/// drift or with neither. They were measured without it, so that their derivatives are inexact.
void CameraErrors::notice_large_error() {
  const DriftHypothesis& rigid = usual_.hypotheses.front();
  const double of_drift = usual_.used().log_likelihood() - rigid.log_likelihood();
  if (has_large_error_ || !(evidence_of_large_error(rigid) > kLargeErrorEvidence + of_drift)) return;
  has_large_error_ = true;
  if (!fresh_) change_by({.covariance = turn_sideways(kTurnSigma_px), .only_forgets = true});
}

/// Uses the likeliest hypothesis, but a drift only if it is likelier than a rigid rig by this log factor.
/// Those that are refuted go on from it.
void CameraErrors::Alternative::select(double least_log_factor) {
  likeliest = 0;
  for (std::size_t i = 1; i < hypotheses.size(); ++i)
    if (hypotheses[i].log_likelihood() > used().log_likelihood()) likeliest = i;
  if (!(used().log_likelihood() > hypotheses[0].log_likelihood() + least_log_factor)) likeliest = 0;
  for (auto& hypothesis : hypotheses)
    if (hypothesis.log_likelihood() < used().log_likelihood() - kRefuted)
      hypothesis.continue_from(used(), kRefuted);
}

void CameraErrors::add_displaced(const EvidenceOfBoth& motion) {
  motions_.push_back(motion);
  const Evidence of_errors = of_rigid_rig(motion);
  for (auto* alternative : {&usual_, &large_error_})
    for (auto& hypothesis : alternative->hypotheses) hypothesis.add_displaced(of_errors);
  if (fresh_) fresh_->errors.add_displaced(of_errors);
}

void CameraErrors::change_by(ErrorChange change) {
  change.motions = motions_.size();
  for (auto* alternative : {&usual_, &large_error_})
    for (auto& hypothesis : alternative->hypotheses) hypothesis.change(change);
  if (fresh_) fresh_->errors.change(change);
  shift_ += change.shift;
  changes_.push_back(change);
}

void CameraErrors::forget(double displacement_px) {
  diffuse(turn_sideways(std::max(displacement_px, kTurnSigma_px)));
}

void CameraErrors::begin_with(const Coefficients& error, const Information& covariance) {
  change_by({.shift = error, .covariance = covariance});
}

/// A prior that was given at the start, for the errors of now.
Evidence CameraErrors::prior_now(const Coefficients& prior, const DriftHypothesis& errors) const {
  if (errors.spread_px2().isZero(0.0)) return {Information(prior.asDiagonal()), prior.cwiseProduct(shift_)};
  Information covariance = errors.spread_px2();
  covariance.diagonal() += prior.cwiseInverse();
  return Evidence::from_covariance(shift_, covariance);
}

Evidence CameraErrors::with_prior(const DriftHypothesis& errors, const Coefficients& prior) const {
  return errors.everything() + (prior_now(prior, errors) - prior_now(widest_prior_, errors));
}

/// log of the density of the motions, up to a constant.
double CameraErrors::log_evidence_with(const Coefficients& prior, const DriftHypothesis& errors) const {
  const Evidence motions = errors.everything() - prior_now(widest_prior_, errors);
  return prior_now(prior, errors).log_evidence(motions);
}

/// log of the Bayes factor of a large error that does not show in the rows.
double CameraErrors::evidence_of_large_error(const DriftHypothesis& errors) const {
  return log_evidence_with(large_error_prior_, errors) - log_evidence_with(usual_prior_, errors);
}

/// Gives the lenses their widest prior, if the motions are much likelier with it than with what the rows
/// suggest.
void CameraErrors::notice_lens_error() {
  if (has_lens_error_) return;
  const Coefficients usual = prior();
  Coefficients wide = usual;
  allow_lens_error(wide);
  has_lens_error_ = log_evidence_with(wide, used()) > log_evidence_with(usual, used()) + kLargeErrorEvidence;
  if (!has_lens_error_) return;
  allow_lens_error(usual_prior_);
  allow_lens_error(large_error_prior_);
}

std::vector<ErrorsDuring> CameraErrors::history() const {
  Evidence begin = diagonal(prior());
  if (begin_) begin = *begin_ + (begin - diagonal(widest_prior_));
  return smoothed_errors(motions_, used().sigmas_px(), changes_, by_displacement_, begin, estimate());
}

}  // namespace stereo_slam
