// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

/// Stamps that are written as numbers, but not in which unit.
namespace stereo_slam {

/// A number as it is written: its digits before a point and those after it, which may be missing.
struct WrittenNumber {
  std::string whole;
  std::string fraction{};
};

/// What numbers say about time.
struct Stamps {
  std::vector<std::int64_t> ns;  ///< of each number; empty if the numbers are no times
  std::string doubt{};           ///< the units that the numbers may have, if that is why `ns` is empty
};

/// The numbers with fractions as decimals. Where a counter of milliseconds, microseconds or nanoseconds was
/// written after the point without its leading zeros, 5.50000 for 5.05 s, these are added. Throws
/// std::invalid_argument, with both readings, if the numbers do not show which of the two they are.
[[nodiscard]] std::vector<WrittenNumber> with_decimals(const std::vector<WrittenNumber>& numbers);

/// The stamps of numbers in a common unit, in any order. The unit is the one of seconds, milliseconds,
/// microseconds and nanoseconds in which they are times since 1970 (10, 13, 16 or 19 digits before the point)
/// or within 100 days, and in which images follow each other after 1 ms to 2 s. Whole numbers that may count
/// frames are no times.
[[nodiscard]] Stamps stamps_of(const std::vector<WrittenNumber>& numbers);

/// The numbers in the largest unit that holds them all, which is enough to sort them; empty if none does.
[[nodiscard]] std::vector<std::int64_t> sort_keys_of(const std::vector<WrittenNumber>& numbers);

/// The median time between successive ones of these stamps, in any order; 0 if there are less than two.
[[nodiscard]] std::int64_t usual_interval_ns(std::vector<std::int64_t> stamps_ns);

/// Whether images follow each other after 1 ms to 2 s, as where something moves.
[[nodiscard]] bool is_usual_interval(std::int64_t interval_ns);

/// How many of the times between successive stamps differ by more than a quarter from the median.
[[nodiscard]] std::size_t count_odd_intervals(std::vector<std::int64_t> stamps_ns);

}  // namespace stereo_slam
