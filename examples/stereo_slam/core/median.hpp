// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <vector>

namespace stereo_slam {

/// The median, the upper one of an even number of values; 0 of none.
[[nodiscard]] inline double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace stereo_slam
