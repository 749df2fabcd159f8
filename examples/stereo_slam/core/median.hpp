// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace stereo_slam {

/// The smallest value that has at least `share` (0 to 1) of the values below it; the largest if there is
/// none, and 0 of no values.
[[nodiscard]] inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto below = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  const auto found = values.begin() + static_cast<std::ptrdiff_t>(std::min(below, values.size() - 1));
  std::nth_element(values.begin(), found, values.end());
  return *found;
}

/// The median, the upper one of an even number of values; 0 of none.
[[nodiscard]] inline double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

}  // namespace stereo_slam
