// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/exposure_delay.hpp"

#include <cmath>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include <antipode/filters/robust_least_squares.hpp>

#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/rig/image_displacement.hpp"

namespace stereo_slam {
namespace {

constexpr double kUnknown_px = 10.0;  // a rotation of the right camera in one frame
constexpr double kInterval_s = 1e-4;  // of a finite difference: points move by less than a pixel

constexpr int kRotation = 4;  // that of one frame: b, c, d and e of ImageDisplacement
constexpr int kConsidered = RectificationResidual::kTerms + 1;  // row coefficients, and the delay
using Rotation = antipode::VectorChart<double, kRotation>;

/// A row error, and how it depends on the rotation and on row coefficients and delay.
struct RowOfMatch {
  antipode::Vector<double, 1> error_px;
  antipode::Matrix<double, 1, kRotation> by_rotation;
  antipode::Matrix<double, 1, kConsidered> by_considered;
};

/// The rows of a frame as the model of robust_least_squares().
struct RowsOfFrame {
  std::span<const RowOfMatch> rows;

  template <class Sums>
  void operator()(const Rotation::Point& rotation, Sums& sums) const {
    const auto information =
        antipode::Matrix<double, 1>::Constant(1.0 / (kRowSigma_px * kRowSigma_px)).eval();
    for (const auto& row : rows) {
      const antipode::Vector<double, 1> left = row.error_px - row.by_rotation * rotation;
      sums.template add<1>(left, information, row.by_rotation, row.by_considered);
    }
  }
};

[[nodiscard]] DelayEstimate delay_of(const antipode::GaussianInformation<double, kConsidered>& evidence) {
  constexpr int kDelay = kConsidered - 1;
  return {.seconds = evidence.mean()[kDelay], .sigma_s = std::sqrt(evidence.covariance()(kDelay, kDelay))};
}

}  // namespace

DelayDerivatives::DelayDerivatives(const RectificationResidual& geometry, const RigVelocity& velocity,
                                   double delay_s)
    : before_(geometry.late(velocity.motion_in(delay_s - kInterval_s))),
      now_(geometry.late(velocity.motion_in(delay_s))),
      after_(geometry.late(velocity.motion_in(delay_s + kInterval_s))) {}

DelayDerivative DelayDerivatives::of(const StereoPoint& z) const {
  const Vector2<double> left_px = now_.left_position(z);
  const Vector2<double> right_px = now_.right_position(left_px, z.z());
  const StereoMeasurement first = before_.measure(left_px, right_px);
  const StereoMeasurement last = after_.measure(left_px, right_px);
  return {(last.z.z() - first.z.z()) / (2.0 * kInterval_s),
          (last.row_error_px - first.row_error_px) / (2.0 * kInterval_s)};
}

void ExposureDelay::begin_with(const DelayEstimate& known) {
  if (!std::isfinite(known.seconds) || !(known.sigma_s > 0.0) || !std::isfinite(known.sigma_s))
    throw std::invalid_argument(
        fmt::format("a delay of {} s with the standard deviation {} s", known.seconds, known.sigma_s));
  const double information = 1.0 / (known.sigma_s * known.sigma_s);
  rows_ = {};
  rows_.information.diagonal().head<kRows>().setConstant(1.0 / (row_sigma_px_ * row_sigma_px_));
  rows_.information(kRows, kRows) = information;
  rows_.vector[kRows] = information * known.seconds;
  used_ = known;
}

void ExposureDelay::add(std::span<const StereoMeasurement> matches, const RectificationResidual& geometry,
                        const RigVelocity& velocity, const StereoCamera& camera) {
  if (!used_) return;
  if (frame_s_ <= 0.0) frame_s_ = velocity.frame_s;
  const DelayDerivatives derivatives(geometry, velocity, used_->seconds);
  std::vector<RowOfMatch> rows;
  for (const auto& match : matches) {
    RowOfMatch row;
    const Vector2<double> right_px(match.z.x() - match.z.z(), match.z.y());
    row.error_px[0] = -match.row_error_px;
    row.by_rotation = ImageDisplacement::basis(right_px, camera).row(1).tail<kRotation>();
    row.by_considered << geometry.basis(match.left_px).transpose(),
        derivatives.of(match.z).row_error_px_per_s;
    rows.push_back(row);
  }
  antipode::LeastSquaresPrior<Rotation, kConsidered> unknown{Rotation::Point::Zero()};
  unknown.information.diagonal().setConstant(1.0 / (kUnknown_px * kUnknown_px));
  const auto fit = antipode::robust_least_squares<Rotation, kConsidered>(
      Rotation::Point::Zero(), RowsOfFrame{rows}, kOutlierLoss, {.check_modes = false}, &unknown);
  const auto& shown = fit.considered;  // relative to what the rows were measured with
  if (!shown.information.allFinite() || !shown.vector.allFinite()) return;
  antipode::Vector<double, kConsidered> applied;
  applied << geometry.coefficients().row(1).transpose(), used_->seconds;
  rows_.information += shown.information;
  rows_.vector += shown.vector + shown.information * applied;
}

void ExposureDelay::advance(const antipode::GaussianInformation<double, 1>& by_motions) {
  constexpr double kAgree =
      3.0;  // standard deviations: motions that were measured with a wrong delay mislead
  constexpr double kSettled_frames = 0.01;
  if (!used_) return;
  used_ = delay_of(rows_);
  if (!(used_->sigma_s < kSettled_frames * frame_s_)) return;
  auto all = rows_;
  all.information(kRows, kRows) += by_motions.information(0, 0);
  all.vector[kRows] += by_motions.vector[0];
  const DelayEstimate with_motions = delay_of(all);
  if (std::abs(with_motions.seconds - used_->seconds) < kAgree * used_->sigma_s) used_ = with_motions;
}

}  // namespace stereo_slam
