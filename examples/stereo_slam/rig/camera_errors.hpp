// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/rig/camera_drift.hpp"

namespace stereo_slam {

/// The Gaussian estimate of the errors that only motions show: the disparity offset and the lenses.
///
/// Its prior has the mean zero and the standard deviation that the row offset suggests. Two errors hardly
/// show in the rows: a wrong column of the right image, and a right camera that is turned sideways. They get
/// a wide prior if the motions are much likelier with it, and so do the lenses.
///
/// The rig may drift while driving. By how much from one keyframe to the next is one of several hypotheses,
/// of which the likeliest is used. One that is much less likely goes on from what the likeliest knows, so
/// that it notices when the rig begins to drift, or comes to rest.
class CameraErrors : public ErrorTerms {
 public:
  static constexpr int kOffsetTerms = kOffset;
  static constexpr int kTerms = kAll;
  /// Standard deviation of a coefficient of the lenses, relative to that of one of the offset, for rows of
  /// the same size. Learned with 30, those of KITTI are 18 and 10 times as large, and those of EuRoC 32
  /// and 30. With 30, a column that is wrong by 8 px passed for a lens error.
  static constexpr double kLensPerOffset = 15.0;
  /// Change of the coefficients that is too large for derivatives at the earlier ones, px.
  static constexpr double kLargeChange_px = 0.35;
  /// Part of a change that derivatives get wrong, as seen when an offset of 1 to 5 px is learned.
  static constexpr double kNotFirstOrder = 0.5;
  using Information = Covariance;

  /// No standard deviation of the prior is larger than `widest_sigma_px`.
  CameraErrors(double widest_sigma_px, const ByDisplacement& by_displacement);

  /// Everything added so far and the widest prior.
  [[nodiscard]] const Evidence& everything() const { return used().everything(); }
  /// Resumes from everything() and has_large_error() of another one with the same widest prior, whose errors
  /// have drifted since by one with the covariance `drift`, px^2. Call expect() before. What the other one
  /// learned is dropped once the motions are likelier without it.
  void resume(const Evidence& everything, bool has_large_error,
              const Information& drift = Information::Zero());
  /// Whether what another one had learned was dropped.
  [[nodiscard]] bool dropped_learned() const noexcept { return dropped_learned_; }

  /// The standard deviations of the priors of the offset and of the lenses, px.
  void expect(double offset_sigma_px, double lens_sigma_px);

  /// Adds what a motion shows that was measured with the coefficients `applied`.
  void add(const EvidenceOfBoth& motion, const Coefficients& applied);
  /// Adds what a motion shows while the right camera vibrates, or is late: its displacement is measured
  /// otherwise.
  void add_displaced(const EvidenceOfBoth& motion);

  /// Forgets most of what is known of the errors that hardly show in the rows: the last motion was measured
  /// without knowing that the right camera moves, by as much as `displacement_px`. The motions so far keep
  /// the estimate of now.
  void forget(double displacement_px);

  /// The coefficients have changed by this, px, and go on with the uncertainty that they had.
  void shift(const Coefficients& change) { change_by({.shift = change}); }

  /// Begins with a large error, which is known with this covariance, px and px^2.
  void begin_with(const Coefficients& error, const Information& covariance);

  /// Forgets a part: the coefficients have changed by an error with this covariance, px^2.
  void diffuse(const Information& covariance) { change_by({.covariance = covariance}); }

  /// Whether it contains an error that is larger than the rows suggest.
  [[nodiscard]] bool has_large_error() const noexcept { return has_large_error_ || !shift_.isZero(0.0); }
  /// The estimate now.
  [[nodiscard]] Evidence estimate() const { return with_prior(used(), prior()); }
  /// By how much the right image is displaced from one keyframe to the next: the standard deviation of each
  /// coefficient of an ImageDisplacement, px. Zero for a rigid rig.
  [[nodiscard]] double drift_sigma_px() const { return used().sigma_px(); }
  /// The errors during each of the motions so far.
  [[nodiscard]] std::vector<ErrorsDuring> history() const;

 private:
  /// The hypotheses of how the rig drifts, with one of the priors.
  struct Alternative {
    std::vector<DriftHypothesis> hypotheses;
    std::size_t likeliest = 0;

    [[nodiscard]] const DriftHypothesis& used() const { return hypotheses[likeliest]; }
    void select(double least_log_factor);
  };
  /// What is known if nothing was learned by another one.
  struct Fresh {
    DriftHypothesis errors;
    double log_factor;  // of its likelihood, relative to that with what was learned
  };

  [[nodiscard]] const DriftHypothesis& used() const {
    return (has_large_error_ ? large_error_ : usual_).used();
  }
  void add_to(Alternative& alternative, const Coefficients& prior, const EvidenceOfBoth& motion) const;
  void change_by(ErrorChange change);
  [[nodiscard]] Evidence prior_now(const Coefficients& prior, const DriftHypothesis& errors) const;
  [[nodiscard]] Evidence with_prior(const DriftHypothesis& errors, const Coefficients& prior) const;
  [[nodiscard]] const Coefficients& prior() const {
    return has_large_error_ ? large_error_prior_ : usual_prior_;
  }
  [[nodiscard]] double log_evidence_with(const Coefficients& prior, const DriftHypothesis& errors) const;
  [[nodiscard]] double evidence_of_large_error(const DriftHypothesis& errors) const;
  void notice_large_error();
  void notice_lens_error();
  void allow_lens_error(Coefficients& prior) const;
  void begin_hypotheses(const Evidence& everything);
  void check_learned(const EvidenceOfBoth& motion, const DriftHypothesis& before);

  ByDisplacement by_displacement_;
  Alternative usual_, large_error_;
  Coefficients shift_ = Coefficients::Zero();  // by all changes, px
  std::optional<Evidence> begin_;              // what another one had learned, if this one resumed
  std::optional<Fresh> fresh_;                 // the same is not dropped yet
  bool dropped_learned_ = false;
  Coefficients widest_prior_, usual_prior_, large_error_prior_;  // information, 1/px^2
  bool has_large_error_ = false;
  bool has_lens_error_ = false;
  std::vector<EvidenceOfBoth> motions_;  // that were added
  std::vector<ErrorChange> changes_;
};

}  // namespace stereo_slam
