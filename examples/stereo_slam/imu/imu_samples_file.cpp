// SPDX-License-Identifier: MIT
#include "stereo_slam/imu/imu_samples_file.hpp"

#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/table_row.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kNumbers = 6;

/// A row; nothing unless it is a stamp and six numbers of a sensor.
[[nodiscard]] std::optional<ImuSample> sample_of(std::string_view row) {
  const auto fields = split_row(row, separator_of(row));
  if (fields.size() < 1 + kNumbers) return std::nullopt;
  const bool seconds = fields[0].find('.') != std::string_view::npos;
  const auto stamp_ns = seconds ? parse_seconds(fields[0]) : parse_nanoseconds(fields[0]);
  if (!stamp_ns) return std::nullopt;
  antipode::Vector6<double> readings;
  for (std::size_t i = 0; i < kNumbers; ++i) {
    const auto number = parse_numbers(fields[1 + i]);
    if (!number || number->size() != 1) return std::nullopt;
    readings[static_cast<Eigen::Index>(i)] = number->front();
  }
  const ImuSample sample{*stamp_ns, readings.head<3>(), readings.tail<3>()};
  return is_plausible(sample) ? std::optional(sample) : std::nullopt;
}

/// Whether a line names the columns.
[[nodiscard]] bool is_heading(std::string_view line) {
  const std::string_view first = line.substr(0, line.find_first_of(",; \t"));
  return first.find_first_of("0123456789") == std::string_view::npos;
}

}  // namespace

ImuSamples read_imu_samples(const std::filesystem::path& file) {
  auto lines = read_text_lines(file);
  if (!lines.empty() && is_heading(lines.front().text)) lines.erase(lines.begin());
  ImuFaults faults{.records = lines.size()};
  std::vector<ImuSample> samples;
  samples.reserve(lines.size());
  for (const auto& line : lines) {
    if (const auto sample = sample_of(line.text)) {
      samples.push_back(*sample);
    } else if (faults.unreadable++ == 0) {
      faults.first_unreadable = static_cast<std::size_t>(line.number);
    }
  }
  if (2 * faults.unreadable > faults.records) {
    fail_at(file, static_cast<int>(faults.first_unreadable),
            "is not 'stamp in ns, wx, wy, wz in rad/s, ax, ay, az in m/s^2', and so are {} of {} rows",
            faults.unreadable, faults.records);
  }
  try {
    return usable_samples(std::move(samples), faults);
  } catch (const std::invalid_argument& error) {
    fail(file, error.what());
  }
}

}  // namespace stereo_slam
