// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <vector>

namespace stereo_slam::report {

/// From `low` to `high`, which are finite, low < high.
struct Range {
  double low = 0.0;
  double high = 1.0;
};

/// Smallest range of the finite values; (0, 1) if there are none, widened if they are all the same.
[[nodiscard]] Range range_of(std::span<const double> values);

/// Position of a range in an image; pixels may run in the opposite direction.
struct Axis {
  Range range;
  double low_px = 0.0;
  double high_px = 1.0;

  [[nodiscard]] double to_px(double value) const {
    return low_px + (value - range.low) / (range.high - range.low) * (high_px - low_px);
  }
};

/// Round numbers within a range: multiples of `step`, which is 1, 2 or 5 times a power of ten.
struct Ticks {
  double step = 1.0;
  std::vector<double> values;
};

/// About `count` ticks.
[[nodiscard]] Ticks nice_ticks(const Range& range, double count);

/// The range extended to the next ticks.
[[nodiscard]] Range rounded_out(const Range& range, double count);

/// The value with as many decimals as the step needs.
[[nodiscard]] std::string tick_label(double value, double step);

}  // namespace stereo_slam::report
