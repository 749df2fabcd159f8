// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/pair_geometry.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "stereo_slam/core/median.hpp"

namespace stereo_slam {
namespace {

/// Powers of x and y of the terms.
constexpr std::array<std::array<int, 2>, PairGeometry::kTerms> kPowers = {
    {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}, {3, 0}, {2, 1}, {1, 2}, {0, 3}}};

}  // namespace

PairGeometry::Basis PairGeometry::basis(const Vector2<double>& left_px) const {
  const double x = 2.0 * (left_px.x() - camera_.cx) / camera_.width_px;
  const double y = 2.0 * (left_px.y() - camera_.cy) / camera_.height_px;
  Basis terms;
  terms << 1.0, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
  return terms;
}

Vector2<double> PairGeometry::right_position(const Vector2<double>& left_px, double disparity_px) const {
  const Vector2<double> exact_px = exposure_.right_position(lens_.corrected(left_px), disparity_px);
  Vector2<double> right_px = lens_.in_image(exact_px) + coefficients_ * basis(left_px);
  if (is_displaced_) right_px += ImageDisplacement::basis(right_px, camera_) * displacement_;
  return right_px;
}

double PairGeometry::rms(const Basis& coefficients) {
  const auto mean = [](int power) { return power % 2 == 0 ? 1.0 / (power + 1) : 0.0; };  // over [-1, 1]
  double sum = 0.0;
  for (std::size_t i = 0; i < kPowers.size(); ++i) {
    for (std::size_t j = 0; j < kPowers.size(); ++j) {
      sum += coefficients[static_cast<Eigen::Index>(i)] * coefficients[static_cast<Eigen::Index>(j)] *
             mean(kPowers[i][0] + kPowers[j][0]) * mean(kPowers[i][1] + kPowers[j][1]);
    }
  }
  return std::sqrt(sum);
}

Vector2<double> PairGeometry::rms_offset_px() const {
  return {rms(coefficients_.row(0).transpose()), rms(coefficients_.row(1).transpose())};
}

StereoMeasurement PairGeometry::measure(const Vector2<double>& left_px,
                                        const Vector2<double>& right_px) const {
  Vector2<double> without_offset_px = right_px - coefficients_ * basis(left_px);
  if (is_displaced_) {
    // The basis is that of the undisplaced position: the inverse of right_position(), to first order of what
    // is left.
    const Vector2<double> undisplaced_px =
        right_px - ImageDisplacement::basis(right_px, camera_) * displacement_;
    without_offset_px -= ImageDisplacement::basis(undisplaced_px, camera_) * displacement_;
  }
  const Vector2<double> corrected_px = lens_.corrected(left_px);
  const LateExposure::Seen seen = exposure_.measure(corrected_px, lens_.corrected(without_offset_px));
  return {.z = {corrected_px.x(), corrected_px.y(), seen.disparity_px},
          .left_px = left_px,
          .row_error_px = seen.row_error_px,
          .disparity_per_px = seen.disparity_per_px};
}

RobustLine PairGeometry::fit_rows(std::span<const CornerPair> corners) const {
  constexpr double kLeastScale_px = 0.1;
  std::vector<Vector2<double>> points;
  std::vector<double> rows_px;
  points.reserve(corners.size());
  rows_px.reserve(corners.size());
  for (const auto& [left_px, right_px] : corners) {
    const Vector2<double> position_px(left_px.x, left_px.y);
    rows_px.push_back(static_cast<double>(right_px.y) - static_cast<double>(left_px.y));
    points.emplace_back(basis(position_px)[1], rows_px.back());
  }
  return fit_line(points, {.offset = median(std::move(rows_px))}, kLeastScale_px);
}

}  // namespace stereo_slam
