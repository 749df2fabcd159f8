// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/right_delay.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include <antipode/filters/robust_least_squares.hpp>

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/core/robust_line.hpp"

namespace stereo_slam {
namespace {

constexpr double kLeastLikelyRows_px = 0.02;
constexpr double kSigmaOfMedian = 1.4826;  // of normal errors: 1 / 0.6745

/// What the rows of all pairs have in common: the delay, another scale of the rows, and a radial distortion
/// that is left in both images (k1, k2).
constexpr int kCommon = 4;
using Common = antipode::Vector<double, kCommon>;

/// What differs from pair to pair if the rig vibrates: a rotation of the right camera (pitch, roll, yaw), px.
using OwnOfPair = Vector3<double>;

/// What a point tells: its right row differs from the left one by coefficients . common + by_rotation . own
/// of its pair.
struct RowOfPoint {
  double differ_px = 0.0;
  Common coefficients;
  OwnOfPair by_rotation;
};

/// The points of each pair of frames.
using Rows = std::vector<std::vector<RowOfPoint>>;

/// By how much rows differ.
struct RowDifferences {
  Common common = Common::Zero();
  std::vector<OwnOfPair> own;  ///< of each pair

  [[nodiscard]] double error_px(const RowOfPoint& row, std::size_t pair) const {
    return row.differ_px - row.coefficients.dot(common) - row.by_rotation.dot(own[pair]);
  }
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
      row.coefficients << (point.second_px.y() - point.first_px.y()) / static_cast<double>(gap), left.y(),
          kFocal_px * left.y() * (right2 - left2), kFocal_px * left.y() * (right2 * right2 - left2 * left2);
      row.by_rotation << 1.0 + right.y() * right.y(), right.x(), right.x() * right.y();
      const bool usable =
          std::isfinite(row.differ_px) && row.coefficients.allFinite() && row.by_rotation.allFinite();
      if (usable) rows[k].push_back(row);  // not with a focal length of zero
    }
  }
  return rows;
}

double median_error(const Rows& rows, const RowDifferences& x) {
  std::vector<double> errors;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    for (const auto& row : rows[k]) errors.push_back(std::abs(x.error_px(row, k)));
  }
  return median(std::move(errors));
}

/// The pitch and roll that belong to a delay, without what else the pairs have in common.
RowDifferences begin_with(double delay, const Rows& rows) {
  constexpr double kLeastScale_px = 0.1;
  RowDifferences x;
  x.common[0] = delay;
  for (const auto& of_pair : rows) {
    std::vector<Vector2<double>> rests;  // over the position along the row
    std::vector<double> rests_px;
    for (const auto& row : of_pair) {
      rests_px.push_back(row.differ_px - row.coefficients.dot(x.common));
      rests.emplace_back(row.by_rotation.y(), rests_px.back());
    }
    const double middle_px = rests_px.empty() ? 0.0 : median(std::move(rests_px));
    const RobustLine line = fit_line(rests, {.offset = middle_px}, kLeastScale_px);
    x.own.emplace_back(line.offset, line.slope, 0.0);
  }
  return x;
}

/// The points of one pair as the model of robust_least_squares().
struct PairModel {
  const std::vector<RowOfPoint>& rows;
  const Common& common;

  template <class Sums>
  void operator()(const OwnOfPair& own, Sums& sums) const {
    const antipode::Matrix<double, 1> one = antipode::Matrix<double, 1>::Identity();
    for (const auto& row : rows) {
      const antipode::Vector<double, 1> error(row.differ_px - row.coefficients.dot(common) -
                                              row.by_rotation.dot(own));
      sums.template add<1>(error, one, row.by_rotation.transpose(), row.coefficients.transpose());
    }
  }
};

/// Ten steps of least squares with Cauchy weights. Returns the variance of the delay for errors of one pixel.
double improve(RowDifferences& x, const Rows& rows) {
  using Own = antipode::VectorChart<double, 3>;
  using Evidence = antipode::GaussianInformation<double, kCommon>;
  constexpr int kSteps = 10;
  constexpr double kLeastScale_px = 0.05;
  constexpr double kWide = 1e-9;  // information where nothing shows a coefficient
  // What the common coefficients usually are, for rows with errors of .05 px: focal lengths that differ by
  // .2 %, and the distortion of KITTI's rectified images.
  constexpr double kVariance_px2 = 0.05 * 0.05;
  const Common sigma(1e3, 1.5, 0.03, 0.03);
  const Evidence prior{(kVariance_px2 * sigma.cwiseAbs2().cwiseInverse()).asDiagonal().toDenseMatrix()};
  const antipode::LeastSquaresPrior<Own, kCommon> wide_own{OwnOfPair::Zero(),
                                                           kWide * Matrix3<double>::Identity()};
  Evidence evidence;
  for (int step = 0; step < kSteps; ++step) {
    const double scale_px = std::max(kLeastScale_px, 2.0 * kSigmaOfMedian * median_error(rows, x));
    evidence = prior;
    std::vector<antipode::Matrix<double, 3, kCommon>> own_by_common;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const auto result = antipode::robust_least_squares<Own, kCommon>(x.own[k], PairModel{rows[k], x.common},
                                                                       antipode::CauchyLoss<double>{scale_px},
                                                                       {.check_modes = false}, &wide_own);
      x.own[k] = result.state;
      evidence = evidence + result.considered;
      own_by_common.push_back(result.sensitivity);
    }
    const Common change = evidence.information.ldlt().solve(evidence.vector - prior.information * x.common);
    if (!change.allFinite()) break;  // numbers that overflow
    x.common += change;
    for (std::size_t k = 0; k < rows.size(); ++k) x.own[k] += own_by_common[k] * change;
  }
  return evidence.covariance()(0, 0);
}

/// Minus the log-likelihood, which wrong points hardly change.
double cost_of(const Rows& rows, const RowDifferences& x) {
  constexpr double kScale_px = 0.1;  // twice what rows of good recordings differ by
  const antipode::CauchyLoss<double> loss{1.0};
  double cost = 0.0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    for (const auto& row : rows[k]) cost -= loss.log_density(std::pow(x.error_px(row, k) / kScale_px, 2), 1);
  }
  return cost;
}

/// What fits best, and the variance of its delay for errors of one pixel.
struct BestFit {
  RowDifferences differences;
  double variance = 0.0;
  double cost = std::numeric_limits<double>::infinity();
};

/// The best from several starts: wrong points move by any number of rows, and a vibrating rig moves them too.
BestFit best_fit(const Rows& rows) {
  BestFit best;
  for (const double delay : {0.0, -0.125, 0.125, -0.25, 0.25, -0.375, 0.375, -0.5, 0.5}) {
    BestFit fit{begin_with(delay, rows)};
    fit.variance = improve(fit.differences, rows);
    fit.cost = cost_of(rows, fit.differences);
    if (fit.cost < best.cost || best.differences.own.empty()) best = std::move(fit);
  }
  return best;
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
  return std::abs(frames) > std::max(kLeast, kSigmas * sigma) && rows_px > kLeastLikelyRows_px;
}

bool RightDelay::is_part_of_a_frame() const {
  constexpr double kMost = 0.75;  // frames, half way
  return std::abs(frames) < kMost;
}

bool RightDelay::is_possible() const {
  constexpr double kLeast = 0.02;  // frames: pairs further apart show down to half of a delay of .05
  constexpr double kSigmas = 5.0;  // half of those that decide
  return std::abs(frames) > std::max(kLeast, kSigmas * sigma) && rows_px > kLeastLikelyRows_px;
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
  const BestFit best = best_fit(rows);
  const RowDifferences& x = best.differences;
  const double rest_px = median_error(rows, x);
  return RightDelay{.frames = x.common[0],
                    .sigma = kSigmaOfMedian * rest_px * std::sqrt(std::max(best.variance, 0.0)),
                    .rows_px = std::abs(x.common[0]) * median(std::move(moved_px)),
                    .rest_px = rest_px};
}

bool all_pairs_share(const RightDelay& delay, const StereoCamera& camera,
                     const std::vector<std::vector<MovedPoint>>& pairs, std::size_t gap) {
  constexpr double kLike = 0.5;  // of the delay: an image of another frame is late by ten times as much
  constexpr double kSigmas = 5.0;
  return std::ranges::all_of(pairs, [&](const std::vector<MovedPoint>& pair) {
    const auto alone = right_delay(camera, {pair}, gap);
    return !alone ||
           std::abs(alone->frames - delay.frames) < kLike * std::abs(delay.frames) + kSigmas * alone->sigma;
  });
}

}  // namespace stereo_slam
