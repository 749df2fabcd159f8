// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>

/// Rounds numbers to the digits that mean something. A JSON writer prints the shortest text that reads back
/// as the same number, so rounded numbers take little space. Infinity and NaN are kept; JSON writes null for
/// them.
namespace stereo_slam::report {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();  ///< what is not known

/// Rounds to a number of decimal places.
[[nodiscard]] inline double to_decimals(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  return std::round(value * scale) / scale + 0.0;  // + 0.0: no "-0.0"
}

/// Rounds to a number of significant digits.
[[nodiscard]] inline double to_digits(double value, int digits) {
  if (value == 0.0 || !std::isfinite(value)) return value;
  const int decimals = digits - 1 - static_cast<int>(std::floor(std::log10(std::abs(value))));
  if (decimals >= 0) return to_decimals(value, decimals);
  const double unit = std::pow(10.0, -decimals);
  return std::round(value / unit) * unit;
}

}  // namespace stereo_slam::report
