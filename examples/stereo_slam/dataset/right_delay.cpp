// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/right_delay.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <antipode/filters/robust_least_squares.hpp>

#include "stereo_slam/core/median.hpp"

namespace stereo_slam {
namespace {

constexpr double kSigmaOfMedian = 1.4826;  // of normal errors: 1 / 0.6745

/// What the rows of all pairs have in common: the delay, a plane over the image, and a radial distortion that
/// is left in both images (k1, k2).
using Common = antipode::Vector<double, 5>;

/// What a point tells: its right row differs from the left one by coefficients . common + shift.
struct RowOfPoint {
  double differ_px = 0.0;
  Common coefficients;
};

/// The points of each pair of frames.
using Rows = std::vector<std::vector<RowOfPoint>>;

/// By how much rows differ.
struct RowDifferences {
  Common common = Common::Zero();
  std::vector<double> shift_px;  ///< of the right image, for each pair
};

Rows rows_of(const StereoCamera& camera, const std::vector<std::vector<MovedPoint>>& pairs, std::size_t gap) {
  constexpr double kFocal_px = 1000.0;  // about; for numbers of about one
  const Vector2<double> centre_px(camera.cx, camera.cy);
  Rows rows(pairs.size());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    for (const auto& point : pairs[k]) {
      const Vector2<double> left = (point.first_px - centre_px) / camera.fx;
      const Vector2<double> right = left - Vector2<double>(point.disparity_px / camera.fx, 0.0);
      const double left2 = left.squaredNorm(), right2 = right.squaredNorm();
      RowOfPoint row;
      row.differ_px = point.rows_px;
      row.coefficients << (point.second_px.y() - point.first_px.y()) / static_cast<double>(gap), left,
          kFocal_px * left.y() * (right2 - left2), kFocal_px * left.y() * (right2 * right2 - left2 * left2);
      const bool usable = std::isfinite(row.differ_px) && row.coefficients.allFinite();
      if (usable) rows[k].push_back(row);  // not with a focal length of zero
    }
  }
  return rows;
}

double median_error(const Rows& rows, const RowDifferences& x) {
  std::vector<double> errors;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    for (const auto& row : rows[k])
      errors.push_back(std::abs(row.differ_px - row.coefficients.dot(x.common) - x.shift_px[k]));
  }
  return median(std::move(errors));
}

/// The shifts that belong to a delay, without a plane: medians, which wrong points do not change much.
RowDifferences begin_with(double delay, const Rows& rows) {
  RowDifferences x;
  x.common[0] = delay;
  for (const auto& of_pair : rows) {
    std::vector<double> rests;
    rests.reserve(of_pair.size());
    for (const auto& row : of_pair) rests.push_back(row.differ_px - row.coefficients.dot(x.common));
    x.shift_px.push_back(rests.empty() ? 0.0 : median(std::move(rests)));
  }
  return x;
}

/// The best of some delays. Wrong points move by any number of rows, so that no least squares can begin.
RowDifferences best_begin(const Rows& rows) {
  std::optional<RowDifferences> best;
  double least_px = 0.0;
  for (const double delay : {0.0, -0.125, 0.125, -0.25, 0.25, -0.375, 0.375, -0.5, 0.5}) {
    const RowDifferences x = begin_with(delay, rows);
    const double rest_px = median_error(rows, x);
    if (best && rest_px >= least_px) continue;
    best = x;
    least_px = rest_px;
  }
  return *best;
}

/// The points of one pair as the model of robust_least_squares(), for the shift.
struct PairModel {
  const std::vector<RowOfPoint>& rows;
  const Common& common;

  template <class Sums>
  void operator()(const antipode::Vector<double, 1>& shift_px, Sums& sums) const {
    const antipode::Matrix<double, 1> one = antipode::Matrix<double, 1>::Identity();
    for (const auto& row : rows) {
      const antipode::Vector<double, 1> error(row.differ_px - row.coefficients.dot(common) - shift_px[0]);
      sums.template add<1>(error, one, one, row.coefficients.transpose());
    }
  }
};

/// Ten steps of least squares with Cauchy weights. Returns the variance of the delay for errors of one pixel.
double improve(RowDifferences& x, const Rows& rows) {
  using Shift = antipode::VectorChart<double, 1>;
  using Evidence = antipode::GaussianInformation<double, 5>;
  constexpr int kSteps = 10;
  constexpr double kLeastScale_px = 0.05;
  const Evidence wide{1e-9 * antipode::Matrix<double, 5>::Identity()};  // where nothing shows a coefficient
  Evidence evidence;
  for (int step = 0; step < kSteps; ++step) {
    const double scale_px = std::max(kLeastScale_px, 2.0 * kSigmaOfMedian * median_error(rows, x));
    evidence = wide;
    std::vector<Common> shift_by_common;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const auto result = antipode::robust_least_squares<Shift, 5>(
          antipode::Vector<double, 1>(x.shift_px[k]), PairModel{rows[k], x.common},
          antipode::CauchyLoss<double>{scale_px}, {.check_modes = false});
      x.shift_px[k] = result.state[0];
      evidence = evidence + result.considered;
      shift_by_common.emplace_back(result.sensitivity.transpose());
    }
    const Common change = evidence.mean();
    if (!change.allFinite()) break;  // numbers that overflow
    x.common += change;
    for (std::size_t k = 0; k < rows.size(); ++k) x.shift_px[k] += shift_by_common[k].dot(change);
  }
  return evidence.covariance()(0, 0);
}

}  // namespace

bool RightDelay::is_clear() const {
  constexpr double kLeast = 0.15;  // frames; synchronised cameras show up to 0.04
  constexpr double kSigmas = 10.0;
  constexpr double kLeastRows_px = 0.05;  // half of what rows of good recordings differ by
  return std::abs(frames) > std::max(kLeast, kSigmas * sigma) && rows_px > kLeastRows_px;
}

bool RightDelay::is_likely() const {
  constexpr double kLeast = 0.03;  // frames; up to .007 on KITTI, EuRoC and rendered drives
  constexpr double kSigmas = 10.0;
  constexpr double kLeastRows_px = 0.02;
  return std::abs(frames) > std::max(kLeast, kSigmas * sigma) && rows_px > kLeastRows_px;
}

std::optional<RightDelay> right_delay(const StereoCamera& camera,
                                      const std::vector<std::vector<MovedPoint>>& pairs, std::size_t gap) {
  constexpr std::size_t kLeastPoints = 100;
  const Rows rows = rows_of(camera, pairs, gap);
  std::vector<double> moved_px;
  for (const auto& of_pair : rows) {
    for (const auto& row : of_pair) moved_px.push_back(std::abs(row.coefficients[0]));
  }
  if (moved_px.size() < kLeastPoints) return std::nullopt;
  RowDifferences x = best_begin(rows);
  const double variance = improve(x, rows);
  const double rest_px = median_error(rows, x);
  return RightDelay{.frames = x.common[0],
                    .sigma = kSigmaOfMedian * rest_px * std::sqrt(std::max(variance, 0.0)),
                    .rows_px = std::abs(x.common[0]) * median(std::move(moved_px)),
                    .rest_px = rest_px};
}

}  // namespace stereo_slam
