// SPDX-License-Identifier: MIT
#include "stereo_slam/stamps/stamp_units.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/io/stamp_unit.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

constexpr std::int64_t kSecond_ns = nanoseconds_in(StampUnit::kSeconds);
constexpr std::int64_t kLongestRun_ns = 100 * 86'400 * kSecond_ns;  // of a clock that began at zero
constexpr std::int64_t kFrom1990_ns = 631'152'000 * kSecond_ns;

/// Nothing for a number beyond kLatestStamp_ns.
std::optional<std::int64_t> to_ns(const WrittenNumber& number, StampUnit unit) {
  std::int64_t whole = 0;
  const char* const end = number.whole.data() + number.whole.size();
  const auto [stop, error] = std::from_chars(number.whole.data(), end, whole);
  const std::int64_t unit_ns = nanoseconds_in(unit);
  if (error != std::errc{} || stop != end || whole > kLatestStamp_ns / unit_ns) return std::nullopt;
  const auto digit = [&](std::size_t i) {
    return i < number.fraction.size() ? std::int64_t{number.fraction[i] - '0'} : 0;
  };
  std::size_t decimals = 0;
  std::int64_t fraction_ns = 0;
  for (std::int64_t left = unit_ns; left > 1; left /= 10) fraction_ns = 10 * fraction_ns + digit(decimals++);
  const std::int64_t stamp_ns = whole * unit_ns + fraction_ns + (digit(decimals) >= 5 ? 1 : 0);
  return stamp_ns <= kLatestStamp_ns ? std::optional(stamp_ns) : std::nullopt;
}

/// Empty if a number is too large for the unit.
std::vector<std::int64_t> all_to_ns(const std::vector<WrittenNumber>& numbers, StampUnit unit) {
  std::vector<std::int64_t> stamps_ns;
  stamps_ns.reserve(numbers.size());
  for (const auto& number : numbers) {
    const auto stamp_ns = to_ns(number, unit);
    if (!stamp_ns) return {};
    stamps_ns.push_back(*stamp_ns);
  }
  return stamps_ns;
}

std::vector<std::int64_t> intervals_of(std::vector<std::int64_t> stamps_ns) {
  std::ranges::sort(stamps_ns);
  std::adjacent_difference(stamps_ns.begin(), stamps_ns.end(), stamps_ns.begin());
  if (!stamps_ns.empty()) stamps_ns.erase(stamps_ns.begin());
  return stamps_ns;
}

bool are_since_1970(const std::vector<std::int64_t>& stamps_ns) {
  return std::ranges::all_of(stamps_ns, [](auto stamp_ns) { return stamp_ns >= kFrom1990_ns; });
}

bool are_since_zero(const std::vector<std::int64_t>& stamps_ns) {
  return std::ranges::all_of(stamps_ns, [](auto stamp_ns) { return stamp_ns <= kLongestRun_ns; });
}

/// Whether whole numbers may count frames, of which some are left out: they are close, or multiples of what
/// they differ by at least, or irregular. Times of a clock are not.
bool may_count_frames(const std::vector<WrittenNumber>& written) {
  constexpr std::int64_t kLargestStep = 1000;
  constexpr std::int64_t kSmallestTime = 10;
  constexpr std::size_t kMostOdd = 5;  // one of so many
  const auto numbers = all_to_ns(written, kStampUnits.back());
  const std::int64_t usual = usual_interval_ns(numbers);
  if (usual >= kLargestStep) return false;
  std::int64_t step = 0;
  for (const auto difference : intervals_of(numbers)) step = std::gcd(step, difference);
  return usual < kSmallestTime || 2 * step > usual ||
         kMostOdd * count_odd_intervals(numbers) > numbers.size();
}

/// A reading of the numbers.
struct Reading {
  StampUnit unit = StampUnit::kSeconds;
  std::vector<std::int64_t> stamps_ns;
  bool since_1970 = false;
  bool usual = false;
};

/// Whether no number has a fraction, which seconds of images need.
bool are_whole(const std::vector<WrittenNumber>& numbers) {
  return std::ranges::all_of(numbers, [](const auto& number) { return number.fraction.empty(); });
}

/// Every unit in which the numbers are times.
std::vector<Reading> readings_of(const std::vector<WrittenNumber>& numbers) {
  std::vector<Reading> readings;
  for (const StampUnit unit : kStampUnits) {
    if (unit == StampUnit::kSeconds && are_whole(numbers)) continue;
    Reading reading{.unit = unit, .stamps_ns = all_to_ns(numbers, unit)};
    if (reading.stamps_ns.empty()) continue;
    reading.since_1970 = are_since_1970(reading.stamps_ns);
    reading.usual = is_usual_interval(usual_interval_ns(reading.stamps_ns));
    if (reading.since_1970 || (reading.usual && are_since_zero(reading.stamps_ns)))
      readings.push_back(std::move(reading));
  }
  return readings;
}

std::string doubt_about(const std::vector<WrittenNumber>& numbers, const std::vector<Reading>& readings) {
  const auto& first = numbers.front();
  const std::string text = first.whole + (first.fraction.empty() ? "" : "." + first.fraction);
  if (readings.empty()) {
    return fmt::format(
        "{} is no time since 1970 in seconds, milliseconds, microseconds or nanoseconds, and the images "
        "would not follow each other after 1 ms to 2 s in any of these units",
        text);
  }
  std::vector<std::string> units;
  units.reserve(readings.size());
  for (const auto& reading : readings) {
    units.push_back(fmt::format("{} ({:.3g} s between images)", to_string(reading.unit),
                                1e-9 * static_cast<double>(usual_interval_ns(reading.stamps_ns))));
  }
  return fmt::format("{} may be in {}", text, fmt::join(units, " or in "));
}

std::vector<WrittenNumber> padded(std::vector<WrittenNumber> numbers, std::size_t width) {
  for (auto& number : numbers) {
    if (number.fraction.size() < width) number.fraction.insert(0, width - number.fraction.size(), '0');
  }
  return numbers;
}

/// What the fractions of numbers show about how they were written.
struct Fractions {
  std::size_t shortest = std::numeric_limits<std::size_t>::max();
  std::size_t longest = 0;
  bool begins_with_zero = false;  ///< as no counter does
  bool ends_with_zero = false;    ///< as no decimals do that were shortened

  explicit Fractions(const std::vector<WrittenNumber>& numbers) {
    for (const auto& [whole, fraction] : numbers) {
      shortest = std::min(shortest, fraction.size());
      longest = std::max(longest, fraction.size());
      if (fraction.size() < 2) continue;
      begins_with_zero = begins_with_zero || fraction.front() == '0';
      ends_with_zero = ends_with_zero || fraction.back() == '0';
    }
  }
};

}  // namespace

std::int64_t usual_interval_ns(std::vector<std::int64_t> stamps_ns) {
  const auto intervals = intervals_of(std::move(stamps_ns));
  return std::llround(median({intervals.begin(), intervals.end()}));
}

bool is_usual_interval(std::int64_t interval_ns) {
  constexpr std::int64_t kShortest_ns = kSecond_ns / 1000;
  constexpr std::int64_t kLongest_ns = 2 * kSecond_ns;
  return interval_ns >= kShortest_ns && interval_ns <= kLongest_ns;
}

std::size_t count_odd_intervals(std::vector<std::int64_t> stamps_ns) {
  constexpr double kTolerance = 0.25;
  const auto intervals = intervals_of(std::move(stamps_ns));
  const double usual = median({intervals.begin(), intervals.end()});
  return static_cast<std::size_t>(std::ranges::count_if(intervals, [&](auto interval) {
    return !(std::abs(static_cast<double>(interval) - usual) <= kTolerance * usual) || interval == 0;
  }));
}

std::vector<std::int64_t> sort_keys_of(const std::vector<WrittenNumber>& numbers) {
  for (const StampUnit unit : kStampUnits) {
    if (auto keys = all_to_ns(numbers, unit); !keys.empty()) return keys;
  }
  return {};
}

std::vector<WrittenNumber> with_decimals(const std::vector<WrittenNumber>& numbers) {
  constexpr std::array<std::size_t, 3> kCounters = {3, 6, 9};  // digits of ms, us, ns
  const Fractions fractions(numbers);
  // Of a counter, nine of ten values have all its digits.
  const bool has_all_digits = std::ranges::find(kCounters, fractions.longest) != kCounters.end();
  const bool may_be_counter = fractions.shortest != fractions.longest && !fractions.begins_with_zero &&
                              fractions.longest <= kCounters.back();
  if (!may_be_counter || (!has_all_digits && !fractions.ends_with_zero)) return numbers;
  if (has_all_digits && fractions.ends_with_zero) return padded(numbers, fractions.longest);
  struct Candidate {
    std::vector<WrittenNumber> numbers;
    std::size_t odd;
  };
  std::vector<Candidate> candidates;
  const auto add = [&](std::vector<WrittenNumber> read) {
    const std::size_t odd = count_odd_intervals(sort_keys_of(read));
    candidates.push_back({std::move(read), odd});
  };
  for (const auto width : kCounters) {
    if (fractions.longest <= width) add(padded(numbers, width));
    if (fractions.longest == width) break;
  }
  if (!fractions.ends_with_zero) add(numbers);
  std::ranges::stable_sort(candidates, [](const auto& a, const auto& b) { return a.odd < b.odd; });
  if (candidates.size() == 1 || 2 * candidates[0].odd < candidates[1].odd) return candidates[0].numbers;
  const auto shortest = std::ranges::min_element(
      numbers, [](const auto& a, const auto& b) { return a.fraction.size() < b.fraction.size(); });
  throw std::invalid_argument(
      fmt::format("{0}.{1} may be the decimal number, or {0} and a counter of {1} after it, without leading "
                  "zeros; the order of the images depends on it and does not show which",
                  shortest->whole, shortest->fraction));
}

Stamps stamps_of(const std::vector<WrittenNumber>& numbers) {
  const auto find = [](auto& readings, const auto& is_wanted) {
    const auto found = std::ranges::find_if(readings, is_wanted);
    return found == readings.end() ? nullptr : &*found;
  };
  auto readings = readings_of(numbers);
  auto* since_1970 = find(readings, [](const Reading& reading) { return reading.since_1970; });
  if (since_1970 != nullptr && since_1970->usual) return {.ns = std::move(since_1970->stamps_ns)};
  if (since_1970 == nullptr && are_whole(numbers) && may_count_frames(numbers)) return {};
  const auto is_usual_reading = [](const Reading& reading) { return reading.usual; };
  const auto usual = std::ranges::count_if(readings, is_usual_reading);
  if (usual == 1) return {.ns = std::move(find(readings, is_usual_reading)->stamps_ns)};
  if (usual == 0 && since_1970 != nullptr) return {.ns = std::move(since_1970->stamps_ns)};
  return {.ns = {}, .doubt = doubt_about(numbers, readings)};
}

}  // namespace stereo_slam
