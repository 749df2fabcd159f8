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
constexpr double kLeastStep_m = 1e-4;

constexpr int kOwn = 6;  // of one frame: a rotation and a translation of the right camera
constexpr int kConsidered = PairGeometry::kTerms + 1;  // row coefficients, and the delay
using Own = antipode::VectorChart<double, kOwn>;

/// A row error, and how it depends on what the frame has of its own and on row coefficients and delay.
struct RowOfMatch {
  antipode::Vector<double, 1> error_px;
  antipode::Matrix<double, 1, kOwn> by_own;
  antipode::Matrix<double, 1, kConsidered> by_considered;
};

/// The rows of a frame as the model of robust_least_squares().
struct RowsOfFrame {
  std::span<const RowOfMatch> rows;

  template <class Sums>
  void operator()(const Own::Point& own, Sums& sums) const {
    const auto information =
        antipode::Matrix<double, 1>::Constant(1.0 / (kRowSigma_px * kRowSigma_px)).eval();
    for (const auto& row : rows) {
      const antipode::Vector<double, 1> left = row.error_px - row.by_own * own;
      sums.template add<1>(left, information, row.by_own, row.by_considered);
    }
  }
};

[[nodiscard]] DelayEstimate delay_of(const antipode::GaussianInformation<double, kConsidered>& evidence) {
  constexpr int kDelay = kConsidered - 1;
  return {.seconds = evidence.mean()[kDelay], .sigma_s = std::sqrt(evidence.covariance()(kDelay, kDelay))};
}

}  // namespace

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

void ExposureDelay::add(std::span<const StereoMeasurement> matches, const PairGeometry& geometry,
                        const LateMotion& motion, const StereoCamera& camera) {
  if (!used_) return;
  const LateExposure exposure(camera, motion.in(used_->seconds));
  std::vector<RowOfMatch> rows;
  for (const auto& match : matches) {
    RowOfMatch row;
    const Vector2<double> right_px(match.z.x() - match.z.z(), match.z.y());
    const Eigen::RowVector3d by_step = exposure.by_step(match.z.head<2>(), match.z.z()).row(1);
    row.error_px[0] = -match.row_error_px;
    row.by_own << ImageDisplacement::basis(right_px, camera).row(1) * ImageDisplacement::by_rotation(camera),
        by_step;
    row.by_considered << geometry.basis(match.left_px).transpose(), by_step * motion.m_per_s;
    rows.push_back(row);
  }
  antipode::LeastSquaresPrior<Own, kConsidered> own{Own::Point::Zero()};
  Own::Point sigma;
  sigma << Vector3<double>::Constant(kUnknown_px / camera.fx),
      (std::abs(used_->seconds) * motion.sigma_m_per_s).cwiseMax(kLeastStep_m);
  own.information = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  const auto fit = antipode::robust_least_squares<Own, kConsidered>(
      Own::Point::Zero(), RowsOfFrame{rows}, kOutlierLoss, {.check_modes = false}, &own);
  const auto& shown = fit.considered;  // relative to what the rows were measured with
  if (!shown.information.allFinite() || !shown.vector.allFinite()) return;
  antipode::Vector<double, kConsidered> applied;
  applied << geometry.coefficients().row(1).transpose(), used_->seconds;
  rows_.information += shown.information;
  rows_.vector += shown.vector + shown.information * applied;
}

void ExposureDelay::advance() {
  if (used_) used_ = delay_of(rows_);
}

}  // namespace stereo_slam
