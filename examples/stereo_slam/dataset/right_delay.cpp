// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/right_delay.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>

#include "stereo_slam/core/median.hpp"

namespace stereo_slam {
namespace {

constexpr double kSigmaOfMedian = 1.4826;  // of normal errors: 1 / 0.6745

/// What the rows of all pairs have in common: the delay, a plane over the image, and the lenses.
constexpr std::size_t kCommon = 5;

/// A point as one row of the equations.
struct RowOfPoint {
  std::size_t pair = 0;
  double moved_px = 0.0;   ///< by which its row changes from frame to frame
  double differ_px = 0.0;  ///< right minus left row
  Eigen::Vector2d left;    ///< where it is seen, in focal lengths
  Eigen::Vector2d right;
};

std::vector<RowOfPoint> rows_of(const StereoCamera& camera, const std::vector<std::vector<MovedPoint>>& pairs,
                                std::size_t gap) {
  const Eigen::Vector2d centre_px(camera.cx, camera.cy);
  std::vector<RowOfPoint> rows;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    for (const auto& point : pairs[k]) {
      const Eigen::Vector2d left = (point.first_px - centre_px) / camera.fx;
      rows.push_back({.pair = k,
                      .moved_px = (point.second_px.y() - point.first_px.y()) / static_cast<double>(gap),
                      .differ_px = point.rows_px,
                      .left = left,
                      .right = left - Eigen::Vector2d(point.disparity_px / camera.fx, 0.0)});
    }
  }
  return rows;
}

/// What rows differ by: the delay, a plane over the image, a radial distortion that is left in both images
/// (k1, k2), and a displacement of each pair.
Eigen::VectorXd coefficients_of(const RowOfPoint& row, std::size_t pairs) {
  constexpr double kFocal_px = 1000.0;  // about; for numbers of about one
  Eigen::VectorXd a = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kCommon + pairs));
  const double left2 = row.left.squaredNorm();
  const double right2 = row.right.squaredNorm();
  a(0) = row.moved_px;
  a.segment<2>(1) = row.left;
  a(3) = kFocal_px * row.left.y() * (right2 - left2);
  a(4) = kFocal_px * row.left.y() * (right2 * right2 - left2 * left2);
  a(static_cast<Eigen::Index>(kCommon + row.pair)) = 1.0;
  return a;
}

std::vector<double> row_errors(const std::vector<RowOfPoint>& rows, const Eigen::VectorXd& x) {
  std::vector<double> errors;
  errors.reserve(rows.size());
  for (const auto& row : rows)
    errors.push_back(row.differ_px -
                     coefficients_of(row, static_cast<std::size_t>(x.size()) - kCommon).dot(x));
  return errors;
}

double median_size(std::vector<double> values) {
  std::ranges::transform(values, values.begin(), [](double value) { return std::abs(value); });
  return median(std::move(values));
}

/// The displacements of the pairs that belong to a delay, without a plane: medians, which wrong points do not
/// change much.
Eigen::VectorXd begin_with(double delay, const std::vector<RowOfPoint>& rows, std::size_t pairs) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kCommon + pairs));
  x(0) = delay;
  std::vector<std::vector<double>> rests(pairs);
  for (const auto& row : rows) rests[row.pair].push_back(row.differ_px - delay * row.moved_px);
  for (std::size_t k = 0; k < pairs; ++k)
    x(static_cast<Eigen::Index>(kCommon + k)) = median(std::move(rests[k]));
  return x;
}

/// The best of some delays. Wrong points move by any number of rows, so that no least squares can begin.
Eigen::VectorXd best_begin(const std::vector<RowOfPoint>& rows, std::size_t pairs) {
  Eigen::VectorXd best;
  double least_px = 0.0;
  for (const double delay : {0.0, -0.125, 0.125, -0.25, 0.25, -0.375, 0.375, -0.5, 0.5}) {
    const Eigen::VectorXd x = begin_with(delay, rows, pairs);
    const double rest_px = median_size(row_errors(rows, x));
    if (best.size() > 0 && rest_px >= least_px) continue;
    best = x;
    least_px = rest_px;
  }
  return best;
}

/// Ten steps of least squares with Cauchy weights. Returns the variance of the delay for errors of one pixel.
double improve(Eigen::VectorXd& x, const std::vector<RowOfPoint>& rows) {
  constexpr int kSteps = 10;
  constexpr double kLeastScale_px = 0.05;
  Eigen::MatrixXd H;
  for (int step = 0; step < kSteps; ++step) {
    const std::vector<double> errors = row_errors(rows, x);
    const double scale_px = std::max(kLeastScale_px, 2.0 * kSigmaOfMedian * median_size(errors));
    H = 1e-9 * Eigen::MatrixXd::Identity(x.size(), x.size());
    Eigen::VectorXd g = Eigen::VectorXd::Zero(x.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Eigen::VectorXd a = coefficients_of(rows[i], static_cast<std::size_t>(x.size()) - kCommon);
      const double weight = 1.0 / (1.0 + std::pow(errors[i] / scale_px, 2));
      H += weight * a * a.transpose();
      g += weight * errors[i] * a;
    }
    x += H.ldlt().solve(g);
  }
  return H.ldlt().solve(Eigen::VectorXd::Unit(x.size(), 0))(0);
}

}  // namespace

bool RightDelay::is_clear() const {
  constexpr double kLeast = 0.15;  // frames; synchronised cameras show up to 0.04
  constexpr double kSigmas = 10.0;
  constexpr double kLeastRows_px = 0.05;  // half of what rows of good recordings differ by
  return std::abs(frames) > std::max(kLeast, kSigmas * sigma) && rows_px > kLeastRows_px;
}

std::optional<RightDelay> right_delay(const StereoCamera& camera,
                                      const std::vector<std::vector<MovedPoint>>& pairs, std::size_t gap) {
  constexpr std::size_t kLeastPoints = 100;
  const std::vector<RowOfPoint> rows = rows_of(camera, pairs, gap);
  if (rows.size() < kLeastPoints) return std::nullopt;
  Eigen::VectorXd x = best_begin(rows, pairs.size());
  const double variance = improve(x, rows);
  const double rest_px = median_size(row_errors(rows, x));
  std::vector<double> of_delay;
  of_delay.reserve(rows.size());
  for (const auto& row : rows) of_delay.push_back(x(0) * row.moved_px);
  return RightDelay{.frames = x(0),
                    .sigma = kSigmaOfMedian * rest_px * std::sqrt(std::max(variance, 0.0)),
                    .rows_px = median_size(std::move(of_delay)),
                    .rest_px = rest_px};
}

}  // namespace stereo_slam
