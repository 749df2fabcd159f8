// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

/// What the names of a camera's images say about their order and their times.
namespace stereo_slam {

struct NameTimes {
  std::vector<std::int64_t> stamps_ns;  ///< of each name; empty if the names are no stamps
  /// By which the names are sorted: stamps, decimal numbers whose unit is not known, or the values of
  /// hexadecimal numbers. Empty if the names say nothing about time, as 000012 and frame_12.
  std::vector<std::int64_t> keys;
  std::string doubt;  ///< why there are keys, but no stamps
};

/// Reads names without extension, in any order: those of one text with numbers in it. A stamp is one of
/// these:
///  - a number in a unit that stamps_of() finds, left_1626962384.5, 1403636579763555584 or 12.05;
///  - seconds since 1970 and a fraction of a second, 1626962384_050000;
///  - a date and a time of day, 20210722143944500, 2021-07-22T14-39-44.5;
///  - one of these in hexadecimal digits.
/// Throws std::invalid_argument if the names can be read in two ways that give different orders, and if they
/// count images in another order than their stamps.
[[nodiscard]] NameTimes times_in(const std::vector<std::string>& names);

}  // namespace stereo_slam
