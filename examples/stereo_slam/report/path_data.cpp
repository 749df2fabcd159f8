// SPDX-License-Identifier: MIT
#include "stereo_slam/report/path_data.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <fmt/format.h>

namespace stereo_slam::report {
namespace {

/// Indices of [first, last) to draw, in order.
void append_extremes(std::span<const double> values, std::size_t first, std::size_t last,
                     std::vector<std::size_t>& indices) {
  std::optional<std::size_t> lowest, highest, gap;
  for (std::size_t i = first; i < last; ++i) {
    if (!std::isfinite(values[i])) {
      gap = i;
    } else {
      if (!lowest || values[i] < values[*lowest]) lowest = i;
      if (!highest || values[i] > values[*highest]) highest = i;
    }
  }
  const auto begin = static_cast<std::ptrdiff_t>(indices.size());
  if (lowest) indices.push_back(*lowest);
  if (highest && highest != lowest) indices.push_back(*highest);
  if (gap) indices.push_back(*gap);
  std::sort(indices.begin() + begin, indices.end());
}

}  // namespace

std::vector<std::size_t> decimate(std::span<const double> values, std::size_t bins) {
  std::vector<std::size_t> indices;
  if (values.size() <= 2 * bins) {
    indices.resize(values.size());
    std::iota(indices.begin(), indices.end(), std::size_t{0});
    return indices;
  }
  for (std::size_t bin = 0; bin < bins; ++bin)
    append_extremes(values, bin * values.size() / bins, (bin + 1) * values.size() / bins, indices);
  return indices;
}

std::string path_data(std::span<const Vector2<double>> points_px) {
  std::string data;
  const auto is_drawn = [&](std::size_t i) { return i < points_px.size() && points_px[i].allFinite(); };
  for (std::size_t i = 0; i < points_px.size(); ++i) {
    if (!is_drawn(i)) continue;
    const bool starts = i == 0 || !is_drawn(i - 1);
    fmt::format_to(std::back_inserter(data), "{}{:.1f} {:.1f}", starts ? "M" : " ", points_px[i].x(),
                   points_px[i].y());
    if (starts && !is_drawn(i + 1)) data += "h0";  // a point of its own, as wide as the line
  }
  return data;
}

}  // namespace stereo_slam::report
