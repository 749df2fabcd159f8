// SPDX-License-Identifier: MIT
#include "stereo_slam/report/axis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace stereo_slam::report {
namespace {

constexpr double kRounding = 1e-9;  // of a step

[[nodiscard]] double nice_step(const Range& range, double count) {
  const double wanted = (range.high - range.low) / count;
  const double power = std::pow(10.0, std::floor(std::log10(wanted)));
  const double digits = wanted / power;  // 1 to 10
  return power * (digits < 1.5 ? 1.0 : digits < 3.5 ? 2.0 : digits < 7.5 ? 5.0 : 10.0);
}

}  // namespace

Range range_of(std::span<const double> values) {
  Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  }
  if (range.low > range.high) return {};
  const double least = 1e-6 * std::max({1.0, std::abs(range.low), std::abs(range.high)});
  if (range.high - range.low >= least) return range;
  const double half = std::max(0.5 * std::abs(range.low), 0.5);
  return {range.low - half, range.high + half};
}

Ticks nice_ticks(const Range& range, double count) {
  Ticks ticks{.step = nice_step(range, count), .values = {}};
  const auto last = static_cast<long>(std::floor(range.high / ticks.step + kRounding));
  for (auto i = static_cast<long>(std::ceil(range.low / ticks.step - kRounding)); i <= last; ++i) {
    ticks.values.push_back(static_cast<double>(i) * ticks.step);
  }
  return ticks;
}

Range rounded_out(const Range& range, double count) {
  const double step = nice_step(range, count);
  return {step * std::floor(range.low / step + kRounding), step * std::ceil(range.high / step - kRounding)};
}

std::string tick_label(double value, double step) {
  if (step >= 1e5 || step < 1e-4) return fmt::format("{:.3g}", value);
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + kRounding)));
  return fmt::format("{:.{}f}", value, decimals);
}

}  // namespace stereo_slam::report
