// SPDX-License-Identifier: MIT
#include "stereo_slam/stamps/times_file.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "stereo_slam/io/stamp_unit.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

/// The numbers of the lines, as they are written.
std::vector<long double> numbers_in(const std::filesystem::path& file, const std::vector<TextLine>& lines) {
  std::vector<long double> numbers;
  numbers.reserve(lines.size());
  for (const auto& line : lines) {
    const auto fields = split_fields(line.text);
    const auto number = parse_stamp(fields.front());
    if (fields.size() != 1 || !number) {
      fail_at(file, line.number, "'{}' is not one time in seconds", line.text);
    }
    numbers.push_back(*number);
  }
  return numbers;
}

StampUnit unit_of(const std::vector<TextLine>& lines, const std::vector<long double>& numbers) {
  const bool whole = std::ranges::all_of(
      lines, [](const TextLine& line) { return line.text.find_first_of(".eE") == std::string::npos; });
  return unit_of_stamps(numbers, StampUnit::kSeconds, {.shortest_s = 1e-3, .longest_s = whole ? 2.0 : 5.0});
}

}  // namespace

FileTimes read_times(const std::filesystem::path& file) {
  const auto lines = read_text_lines(file);
  const auto numbers = numbers_in(file, lines);
  const StampUnit unit = unit_of(lines, numbers);
  FileTimes times;
  times.stamps_ns.reserve(lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto& line = lines[i];
    const auto stamp_ns = unit == StampUnit::kSeconds ? parse_seconds(split_fields(line.text).front())
                                                      : to_nanoseconds(numbers[i], unit);
    if (!stamp_ns) {
      fail_at(file, line.number, "'{}' is not one time in {}", line.text, to_string(unit));
    }
    if (!times.stamps_ns.empty() && *stamp_ns <= times.stamps_ns.back()) {
      fail_at(file, line.number, "{} is not later than the time before it; times must increase", line.text);
    }
    times.stamps_ns.push_back(*stamp_ns);
  }
  require_whole_last_line(file, lines);
  if (unit != StampUnit::kSeconds)
    times.warning =
        fmt::format("{}: its times are taken as {}, by their size and steps; they should be seconds",
                    file.string(), to_string(unit));
  return times;
}

}  // namespace stereo_slam
