// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "stereo_slam/core/types.hpp"

/// Long series as short SVG paths.
namespace stereo_slam::report {

/// Indices that suffice to draw a series in `bins` columns: the smallest, the largest and one non-finite
/// value of each column. All indices if there are at most two values per column.
[[nodiscard]] std::vector<std::size_t> decimate(std::span<const double> values, std::size_t bins);

/// Attribute `d` of an SVG path through the points; a non-finite point interrupts it.
[[nodiscard]] std::string path_data(std::span<const Vector2<double>> points_px);

}  // namespace stereo_slam::report
