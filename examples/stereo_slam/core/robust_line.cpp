// SPDX-License-Identifier: MIT
#include "stereo_slam/core/robust_line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <antipode/filters/robust_least_squares.hpp>

#include "stereo_slam/core/median.hpp"

namespace stereo_slam {
namespace {

[[nodiscard]] double median_residual(std::span<const Vector2<double>> points, const RobustLine& line) {
  std::vector<double> residuals;
  for (const auto& point : points) residuals.push_back(std::abs(point.y() - line.at(point.x())));
  return median(std::move(residuals));
}

}  // namespace

RobustLine fit_line(std::span<const Vector2<double>> points, const RobustLine& initial, double least_scale) {
  using Lines = antipode::VectorChart<double, 2>;
  using Number = antipode::Vector<double, 1>;
  const auto model = [&](const Lines::Point& x, auto& sums) {
    const RobustLine line{x[0], x[1]};
    const double scale = std::max(median_residual(points, line), least_scale);
    for (const auto& point : points) {
      sums.add(Number(point.y() - line.at(point.x())), Number(1.0 / (scale * scale)),
               antipode::Matrix<double, 1, 2>(1.0, point.x()));
    }
  };
  // The scale changes with the line, and with it the unit of the cost.
  const auto fit = antipode::robust_least_squares<Lines>(
      {initial.offset, initial.slope}, model, antipode::CauchyLoss<double>{1.0},
      {.max_increase = std::numeric_limits<double>::infinity(),
       .covariance = antipode::CovarianceFrom::kNoise,
       .check_modes = false});
  RobustLine line{fit.state[0], fit.state[1]};
  line.median_residual = median_residual(points, line);
  return line;
}

}  // namespace stereo_slam
