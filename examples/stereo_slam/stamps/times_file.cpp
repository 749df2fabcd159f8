// SPDX-License-Identifier: MIT
#include "stereo_slam/stamps/times_file.hpp"

#include <stdexcept>

#include <fmt/format.h>

#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {

std::vector<std::int64_t> read_times(const std::filesystem::path& file) {
  const auto lines = read_text_lines(file);
  std::vector<std::int64_t> stamps_ns;
  stamps_ns.reserve(lines.size());
  for (const auto& line : lines) {
    const auto fields = split_fields(line.text);
    const auto stamp_ns = parse_seconds(fields.front());
    if (fields.size() != 1 || !stamp_ns) {
      throw std::runtime_error(
          at_line(file, line.number, fmt::format("'{}' is not one time in seconds", line.text)));
    }
    if (!stamps_ns.empty() && *stamp_ns <= stamps_ns.back()) {
      throw std::runtime_error(
          at_line(file, line.number,
                  fmt::format("{} is not later than the time before it; times must increase", line.text)));
    }
    stamps_ns.push_back(*stamp_ns);
  }
  require_whole_last_line(file, lines);
  return stamps_ns;
}

}  // namespace stereo_slam
