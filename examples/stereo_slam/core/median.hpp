// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace stereo_slam {

/// The value at index floor(share * n) of the n values in ascending order, at most the last one; 0 if there
/// are no values. `share` is 0 to 1.
[[nodiscard]] inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto below = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  const auto found = values.begin() + static_cast<std::ptrdiff_t>(std::min(below, values.size() - 1));
  std::nth_element(values.begin(), found, values.end());
  return *found;
}

/// The median; the upper of the two middle values if their number is even, and 0 if there are no values.
[[nodiscard]] inline double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

}  // namespace stereo_slam
