// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>

namespace stereo_slam {

/// Seconds since 1970 of a date and time of day, YYYYMMDDhhmmss, in a time zone without an offset. Nothing if
/// it is not 14 digits of a time from 1990 to 2095.
[[nodiscard]] inline std::optional<std::int64_t> seconds_of_date(std::string_view digits) {
  constexpr int kFirstYear = 1990;
  constexpr int kLastYear = 2095;
  if (digits.size() != 14 || digits.find_first_not_of("0123456789") != std::string_view::npos)
    return std::nullopt;
  const auto number = [&](std::size_t at, std::size_t count) {
    int value = 0;
    for (const char digit : digits.substr(at, count)) value = 10 * value + (digit - '0');
    return value;
  };
  const std::chrono::year_month_day date{std::chrono::year(number(0, 4)),
                                         std::chrono::month(static_cast<unsigned>(number(4, 2))),
                                         std::chrono::day(static_cast<unsigned>(number(6, 2)))};
  const int hour = number(8, 2);
  const int minute = number(10, 2);
  const int second = number(12, 2);
  if (!date.ok() || number(0, 4) < kFirstYear || number(0, 4) > kLastYear) return std::nullopt;
  if (hour > 23 || minute > 59 || second > 59) return std::nullopt;
  const std::int64_t days = std::chrono::sys_days(date).time_since_epoch().count();
  return ((days * 24 + hour) * 60 + minute) * 60 + second;
}

}  // namespace stereo_slam
