// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "stereo_slam/core/types.hpp"

/// Long series as short SVG paths.
namespace stereo_slam::report {

/// Indices that are enough to draw a series in `bins` columns: of each its smallest and largest value, and
/// one that is not finite if there is any; all of a series that has no more than two values a bin.
[[nodiscard]] std::vector<std::size_t> decimate(std::span<const double> values, std::size_t bins);

/// Attribute `d` of an SVG path through the points; one that is not finite interrupts it.
[[nodiscard]] std::string path_data(std::span<const Vector2<double>> points_px);

}  // namespace stereo_slam::report
