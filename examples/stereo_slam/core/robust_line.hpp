// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// A line y = offset + slope x.
struct RobustLine {
  double offset = 0.0;
  double slope = 0.0;
  double median_residual = 0.0;  ///< of |y - offset - slope x|

  [[nodiscard]] double at(double x) const noexcept { return offset + slope * x; }
};

/// The line through points (x, y) of which some are wrong, from `initial` on. An error counts half where it
/// is the median, or `least_scale` if that is larger. With fewer than two different x it is the initial one.
[[nodiscard]] RobustLine fit_line(std::span<const Vector2<double>> points, const RobustLine& initial,
                                  double least_scale);

}  // namespace stereo_slam
