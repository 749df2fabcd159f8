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

// Least logarithms of Bayes factors. On undisturbed recordings, real and rendered, that of a large error is
// at most 1.4. That of a turn by kLeastTurn_px or more is at most 8, and by less 22 (on KITTI 01).
constexpr double kLargeErrorEvidence = 5.0;
constexpr double kTurnEvidence = 10.0;
constexpr double kLeastTurn_px = 0.7;
constexpr double kTurnSigma_px = 1.0;
constexpr std::size_t kLongestWindow = 8;  // motions

[[nodiscard]] double squared_inverse(double x) { return 1.0 / (x * x); }

/// Information of a prior, from standard deviations.
[[nodiscard]] Coefficients prior_of(double offset_sigma_px, double lens_sigma_px) {
  Coefficients prior = Coefficients::Constant(squared_inverse(offset_sigma_px));
  prior.tail<LensResidual::kTerms>().setConstant(squared_inverse(lens_sigma_px));
  return prior;
}

/// The estimate without most of what is known of the errors that hardly show in the rows.
[[nodiscard]] Evidence forgotten(const Evidence& estimate, double sigma_px = kTurnSigma_px) {
  Information turn = Information::Zero();
  for (const int term : kUnseenTerms) turn(term, term) = sigma_px * sigma_px;
  return widened(estimate, turn);
}

/// The evidence for coefficients that are larger by `change`.
[[nodiscard]] Evidence shifted(Evidence evidence, const Coefficients& change) {
  evidence.vector += evidence.information * change;
  return evidence;
}

/// Root mean square over a row of the image.
[[nodiscard]] double rms_px(const Coefficients& change) {
  const double constant = change[kUnseenTerms[0]], square = change[kUnseenTerms[1]];
  return std::sqrt(constant * constant + 2.0 / 3.0 * constant * square + square * square / 5.0);
}

}  // namespace

CameraErrors::CameraErrors(double widest_sigma_px)
    : widest_prior_(prior_of(widest_sigma_px, kLensPerOffset * widest_sigma_px)),
      usual_prior_(widest_prior_),
      large_error_prior_(widest_prior_) {
  everything_.information = widest_prior_.asDiagonal();
}

void CameraErrors::resume(const Evidence& everything, const Information& drift) {
  everything_ = everything;
  if (!drift.isZero(0.0)) {
    diffuse(drift);
    learned_ = everything_;
  }
  has_large_error_ = shows_large_error(everything_);
  notice_lens_error();
  begun_with_ = estimate().mean();
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

/// Drops what another one had learned, if all motions since are likelier with the widest prior alone: than
/// with it, or with it and a turn.
void CameraErrors::check_learned(const std::optional<Turn>& turn) {
  if (!learned_) return;
  const Evidence widest{Information(widest_prior_.asDiagonal()), Coefficients::Zero()};
  const Evidence since = everything_ - *learned_;
  const double with_it = turn
                             ? learned_->log_evidence(turn->everything_before - *learned_) +
                                   forgotten(turn->before).log_evidence(everything_ - turn->everything_before)
                             : learned_->log_evidence(since);
  if (widest.log_evidence(since) <= with_it) return;
  everything_ = widest + since;
  learned_.reset();
  dropped_learned_ = true;
  has_lens_error_ = has_large_error_ = false;
}

bool CameraErrors::add(const Evidence& shown) {
  const Evidence motion = shifted(shown, -origin_);
  everything_ = everything_ + motion;
  check_learned({});
  ++motions_;
  ++motions_since_begin_;
  if (recent_.size() == kLongestWindow) recent_.erase(recent_.begin());
  recent_.push_back(motion);
  auto turn = find_turn();
  if (turn && learned_) {
    check_learned(turn);
    if (!learned_) turn.reset();
  }
  if (turn) {
    const bool is_new = !was_so_from_start(*turn);
    if (is_new)
      periods_.push_back({motions_ - turn->motions, shifted(turn->before, origin_), turn->change_px});
    begin_again(shifted(turn->after, origin_));
    return is_new;
  }
  has_large_error_ = has_large_error_ || shows_large_error(everything_);
  notice_lens_error();
  const Evidence now = estimate();
  const bool changed = has_large_error_ && rms_px(now.mean() - begun_with_) > kLargeChange_px;
  if (changed && !learned_) begin_again(forgotten(now));
  return false;
}

void CameraErrors::add_without_turn(const Evidence& motion) {
  everything_ = everything_ + shifted(motion, -origin_);
  ++motions_;
  ++motions_since_begin_;
  recent_.clear();
}

void CameraErrors::forget(double displacement_px) {
  const Evidence before = estimate();
  periods_.push_back({motions_, before, Coefficients::Zero()});
  begin_again(forgotten(before, std::max(displacement_px, kTurnSigma_px)));
}

void CameraErrors::shift(const Coefficients& change) {
  periods_.push_back({motions_, estimate(), Coefficients::Zero()});
  origin_ += change;
  begun_with_ += change;
}

void CameraErrors::begin_with(const Coefficients& error, const Information& covariance) {
  begin_again(shifted(estimate(), error));
  diffuse(covariance);
}

/// The most likely turn of the right camera before one of the last motions.
std::optional<CameraErrors::Turn> CameraErrors::find_turn() const {
  std::optional<Turn> best;
  double best_log_factor = kTurnEvidence;
  Evidence since;
  for (std::size_t motions = 1; motions <= recent_.size(); ++motions) {
    since = since + recent_[recent_.size() - motions];
    const Evidence everything_before = everything_ - since;
    const Evidence before =
        with_prior(everything_before, has_large_error_ || shows_large_error(everything_before));
    const Evidence turned = forgotten(before);
    const double log_factor = turned.log_evidence(since) - before.log_evidence(since);
    const Evidence after = turned + since;
    const Coefficients change_px = after.mean() - before.mean();
    if (!(log_factor > best_log_factor) || rms_px(change_px) < kLeastTurn_px) continue;
    best_log_factor = log_factor;
    best = Turn{motions, everything_before, before, after, change_px};
  }
  return best;
}

/// Goes on from an estimate as if it were the prior.
void CameraErrors::begin_again(const Evidence& estimate) {
  everything_ = estimate;
  origin_.setZero();
  everything_.information.diagonal() -= large_error_prior_ - widest_prior_;
  if (learned_) learned_ = everything_;  // the motions from now on may contradict it still
  begun_with_ = estimate.mean();
  has_large_error_ = true;
  motions_since_begin_ = 0;
  recent_.clear();
}

/// log of the density of the motions in `everything`, up to a constant.
double CameraErrors::log_evidence_with(const Coefficients& prior, const Evidence& everything) const {
  Evidence motions = everything;
  motions.information.diagonal() -= widest_prior_;
  return Evidence{Information(prior.asDiagonal()), Coefficients::Zero()}.log_evidence(motions);
}

/// Whether the motions are much likelier with a large error that does not show in the rows.
bool CameraErrors::shows_large_error(const Evidence& everything) const {
  return log_evidence_with(large_error_prior_, everything) - log_evidence_with(usual_prior_, everything) >
         kLargeErrorEvidence;
}

/// Gives the lenses their widest prior, if the motions are much likelier with it than with what the rows
/// suggest.
void CameraErrors::notice_lens_error() {
  if (has_lens_error_) return;
  const Coefficients usual = has_large_error_ ? large_error_prior_ : usual_prior_;
  Coefficients wide = usual;
  allow_lens_error(wide);
  has_lens_error_ =
      log_evidence_with(wide, everything_) > log_evidence_with(usual, everything_) + kLargeErrorEvidence;
  if (!has_lens_error_) return;
  allow_lens_error(usual_prior_);
  allow_lens_error(large_error_prior_);
}

/// Whether the error has been there from the start, and is now known better. If a large error is known, this
/// means that it was still being learned. Otherwise it is likelier than a turn of a right camera that was not
/// turned.
bool CameraErrors::was_so_from_start(const Turn& turn) const {
  if (!periods_.empty()) return false;
  if (turn.motions == motions_) return true;
  if (has_large_error_) return motions_since_begin_ < turn.motions + kLongestWindow;
  const Evidence since = everything_ - turn.everything_before;
  return log_evidence_with(large_error_prior_, everything_) >
         log_evidence_with(usual_prior_, turn.everything_before) + forgotten(turn.before).log_evidence(since);
}

Evidence CameraErrors::with_prior(const Evidence& everything, bool has_large_error) const {
  Evidence result = everything;
  result.information.diagonal() += (has_large_error ? large_error_prior_ : usual_prior_) - widest_prior_;
  return result;
}

Evidence CameraErrors::everything() const { return shifted(everything_, origin_); }

Evidence CameraErrors::estimate() const {
  return shifted(with_prior(everything_, has_large_error_), origin_);
}

const CameraErrors::Period* CameraErrors::period_of(std::size_t motion) const {
  const auto period = std::find_if(periods_.begin(), periods_.end(),
                                   [motion](const Period& p) { return motion < p.motions; });
  return period == periods_.end() ? nullptr : &*period;
}

}  // namespace stereo_slam
