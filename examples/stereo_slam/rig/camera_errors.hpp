// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>

#include <antipode/distributions/gaussian_information.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/lens_residual.hpp"

namespace stereo_slam {

/// What is known after a change by an error with this covariance.
template <int N>
[[nodiscard]] antipode::GaussianInformation<double, N> widened(
    const antipode::GaussianInformation<double, N>& before, const antipode::Matrix<double, N>& covariance) {
  using Square = antipode::Matrix<double, N>;
  const Square wider = before.information.ldlt().solve(Square::Identity()) + covariance;
  antipode::GaussianInformation<double, N> after{wider.ldlt().solve(Square::Identity())};
  after.vector = after.information * before.mean();
  return after;
}

/// The Gaussian estimate of the errors that only motions show: the disparity offset, which is the horizontal
/// part of a PairGeometry, and the lenses' LensResidual.
///
/// Its prior has the mean zero and the standard deviation that the row offset suggests. Two errors hardly
/// show in the rows: a wrong column of the right image, and a right camera that is turned sideways. They get
/// a wide prior if the motions are much likelier with it, and so do the lenses. And if the last motions are
/// much likelier with a turn of the right camera just before them, what was known of these two errors is
/// forgotten.
class CameraErrors {
 public:
  static constexpr int kOffsetTerms = 10;  ///< those of PairGeometry
  static constexpr int kTerms = kOffsetTerms + LensResidual::kTerms;
  /// Standard deviation of a coefficient of the lenses, relative to that of one of the offset, for rows of
  /// the same size. Learned with 30, those of KITTI are 18 and 10 times as large, and those of EuRoC 32
  /// and 30. With 30, a column that is wrong by 8 px passed for a lens error.
  static constexpr double kLensPerOffset = 15.0;
  /// Change of the coefficients that is too large for derivatives at the earlier ones, px.
  static constexpr double kLargeChange_px = 0.35;
  using Coefficients = antipode::Vector<double, kTerms>;  ///< px; those of the lenses last
  using Information = antipode::Matrix<double, kTerms>;

  using Evidence = antipode::GaussianInformation<double, kTerms>;  ///< 1/px^2, 1/px

  /// The time before a turn of the right camera.
  struct Period {
    std::size_t motions = 0;  ///< measured before its end, since the start
    Evidence estimate;        ///< at its end
    Coefficients turn_px;     ///< the change of the coefficients at its end
  };

  CameraErrors() : CameraErrors(1.0) {}
  /// No standard deviation of the prior is larger than `widest_sigma_px`.
  explicit CameraErrors(double widest_sigma_px);

  /// Everything added so far and the widest prior.
  [[nodiscard]] Evidence everything() const;
  /// Resumes from everything() of another one with the same widest prior, whose errors have drifted since by
  /// one with the covariance `drift`, px^2. Call expect() before. What the other one learned is dropped once
  /// the motions are likelier without it.
  void resume(const Evidence& everything, const Information& drift = Information::Zero());
  /// Whether what another one had learned was dropped.
  [[nodiscard]] bool dropped_learned() const noexcept { return dropped_learned_; }

  /// The standard deviations of the priors of the offset and of the lenses, px.
  void expect(double offset_sigma_px, double lens_sigma_px);

  /// Adds what a motion shows. True if that is a turn of the right camera, at most eight motions ago.
  bool add(const Evidence& motion);

  /// Adds what a motion shows while the right camera vibrates: a turn is not searched.
  void add_without_turn(const Evidence& motion);

  /// Forgets most of what is known of the errors that hardly show in the rows: the last motion was measured
  /// without knowing that the right camera moves, by as much as `displacement_px`. The motions so far keep
  /// the estimate of now.
  void forget(double displacement_px);

  /// The coefficients have changed by this, px, and go on with the uncertainty that they had.
  void shift(const Coefficients& change);

  /// Begins with a large error, which is known with this covariance, px and px^2.
  void begin_with(const Coefficients& error, const Information& covariance);

  /// Forgets a part: the coefficients have changed by an error with this covariance, px^2.
  void diffuse(const Information& covariance) { everything_ = widened(everything_, covariance); }

  /// Whether it contains an error that is larger than the rows suggest.
  [[nodiscard]] bool has_large_error() const noexcept { return has_large_error_ || !origin_.isZero(0.0); }
  /// The estimate now.
  [[nodiscard]] Evidence estimate() const;

  /// The period of a motion, by the number of those before it; null for the present period.
  [[nodiscard]] const Period* period_of(std::size_t motion) const;
  /// The periods before the present one, in order.
  [[nodiscard]] const std::vector<Period>& periods() const noexcept { return periods_; }

 private:
  struct Turn {
    std::size_t motions;         // since then
    Evidence everything_before;  // with the widest prior
    Evidence before, after;      // the estimates
    Coefficients change_px;      // of the coefficients
  };

  [[nodiscard]] std::optional<Turn> find_turn() const;
  [[nodiscard]] double log_evidence_with(const Coefficients& prior, const Evidence& everything) const;
  [[nodiscard]] bool shows_large_error(const Evidence& everything) const;
  void notice_lens_error();
  void check_learned(const std::optional<Turn>& turn);
  void allow_lens_error(Coefficients& prior) const;
  [[nodiscard]] bool was_so_from_start(const Turn& turn) const;
  [[nodiscard]] Evidence with_prior(const Evidence& everything, bool has_large_error) const;
  void begin_again(const Evidence& estimate);

  Evidence everything_;                         // of the coefficients less `origin_`
  Coefficients origin_ = Coefficients::Zero();  // px
  std::optional<Evidence> learned_;             // by another one, from which this one resumed
  bool dropped_learned_ = false;
  Coefficients widest_prior_, usual_prior_, large_error_prior_;  // information, 1/px^2
  bool has_large_error_ = false;
  bool has_lens_error_ = false;
  Coefficients begun_with_ =
      Coefficients::Zero();       // the coefficients with which the first motions were measured, px
  std::vector<Evidence> recent_;  // of the last motions
  std::vector<Period> periods_;
  std::size_t motions_ = 0;
  std::size_t motions_since_begin_ = 0;  // since begin_again()
};

}  // namespace stereo_slam
