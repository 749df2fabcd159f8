// SPDX-License-Identifier: MIT
#include "stereo_slam/io/stamp_unit.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>
#include <vector>

#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

[[nodiscard]] long double seconds_in(StampUnit unit) {
  return 1e-9L * static_cast<long double>(nanoseconds_in(unit));
}

[[nodiscard]] long double middle_of(std::vector<long double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The steps that are not zero, without their signs.
[[nodiscard]] std::vector<long double> steps_of(std::span<const long double> stamps) {
  std::vector<long double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    if (stamps[i] != stamps[i - 1]) steps.push_back(std::fabs(stamps[i] - stamps[i - 1]));
  }
  return steps;
}

[[nodiscard]] bool is_usual(long double step_s, const UsualSteps& usual) {
  return step_s >= static_cast<long double>(usual.shortest_s) &&
         step_s <= static_cast<long double>(usual.longest_s);
}

}  // namespace

std::string_view to_string(StampUnit unit) noexcept {
  switch (unit) {
    case StampUnit::kSeconds:
      return "seconds";
    case StampUnit::kMilliseconds:
      return "milliseconds";
    case StampUnit::kMicroseconds:
      return "microseconds";
    case StampUnit::kNanoseconds:
      break;
  }
  return "nanoseconds";
}

std::optional<long double> parse_stamp(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  long double stamp = 0.0L;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), stamp);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(stamp)) return std::nullopt;
  return stamp;
}

std::optional<std::int64_t> to_nanoseconds(long double stamp, StampUnit unit) {
  const long double stamp_ns = stamp * static_cast<long double>(nanoseconds_in(unit));
  if (!(std::fabs(stamp_ns) <= static_cast<long double>(kLatestStamp_ns))) return std::nullopt;
  return static_cast<std::int64_t>(std::llround(stamp_ns));
}

StampUnit unit_of_stamps(std::span<const long double> stamps, StampUnit expected, const UsualSteps& usual) {
  constexpr long double kEarliest_s = 3e8L;
  constexpr long double kLatest_s = 4e9L;
  constexpr long double kLongestPause_s = 3600.0L;
  constexpr long double kUsualStep_s = 0.05L;
  if (stamps.empty()) return expected;
  const auto steps = steps_of(stamps);
  const long double step = steps.empty() ? 0.0L : middle_of(steps);
  const long double middle = middle_of({stamps.begin(), stamps.end()});
  for (const StampUnit unit : kStampUnits) {
    const long double since_1970_s = middle * seconds_in(unit);
    if (since_1970_s >= kEarliest_s && since_1970_s <= kLatest_s &&
        step * seconds_in(unit) <= kLongestPause_s)
      return unit;
  }
  if (steps.empty() || is_usual(step * seconds_in(expected), usual)) return expected;
  const auto unlikeliness = [&](StampUnit unit) {
    return std::fabs(std::log(step * seconds_in(unit) / kUsualStep_s));
  };
  const StampUnit likeliest = *std::ranges::min_element(
      kStampUnits, [&](StampUnit a, StampUnit b) { return unlikeliness(a) < unlikeliness(b); });
  const auto fitting = std::ranges::count_if(
      steps, [&](long double other) { return is_usual(other * seconds_in(likeliest), usual); });
  return 2 * static_cast<std::size_t>(fitting) > steps.size() ? likeliest : expected;
}

}  // namespace stereo_slam
