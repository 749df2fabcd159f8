// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace stereo_slam {

/// Unit of the stamps of a file, or of those in the names of images.
enum class StampUnit { kSeconds, kMilliseconds, kMicroseconds, kNanoseconds };

inline constexpr std::array kStampUnits = {StampUnit::kSeconds, StampUnit::kMilliseconds,
                                           StampUnit::kMicroseconds, StampUnit::kNanoseconds};

[[nodiscard]] constexpr std::int64_t nanoseconds_in(StampUnit unit) noexcept {
  switch (unit) {
    case StampUnit::kSeconds:
      return 1'000'000'000;
    case StampUnit::kMilliseconds:
      return 1'000'000;
    case StampUnit::kMicroseconds:
      return 1'000;
    case StampUnit::kNanoseconds:
      break;
  }
  return 1;
}

/// "seconds", "milliseconds" ...
[[nodiscard]] std::string_view to_string(StampUnit unit) noexcept;

/// A stamp as it is written, in any unit. Nothing if the text is not a finite number. A long double with a
/// mantissa of 64 bits is exact for nanoseconds since 1970.
[[nodiscard]] std::optional<long double> parse_stamp(std::string_view text);

/// The stamp in nanoseconds. Nothing beyond kLatestStamp_ns.
[[nodiscard]] std::optional<std::int64_t> to_nanoseconds(long double stamp, StampUnit unit);

/// How far apart two successive stamps of a file usually are.
struct UsualSteps {
  double shortest_s = 2e-5;
  double longest_s = 20.0;
};

/// The unit of a file's stamps: the one in which they are times since 1970, from 1979 to 2096, if their steps
/// are possible in this unit; otherwise `expected`, unless it makes the median step shorter or longer than is
/// usual; then the unit in which the median step is nearest to 50 ms, if most steps are usual in it. Single
/// wrong stamps do not decide.
[[nodiscard]] StampUnit unit_of_stamps(std::span<const long double> stamps, StampUnit expected,
                                       const UsualSteps& usual = {});

}  // namespace stereo_slam
