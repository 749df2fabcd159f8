// SPDX-License-Identifier: MIT
#include "stereo_slam/imu/imu_samples_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/table_row.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kNumbers = 6;

/// The six readings: rate, then specific force.
[[nodiscard]] antipode::Vector6<double> readings_of(const ImuSample& sample) {
  antipode::Vector6<double> readings;
  readings << sample.angular_velocity, sample.specific_force;
  return readings;
}

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

void sort_by_stamps(std::vector<ImuSample>& samples, ImuFaults& faults) {
  const auto earlier = [](const ImuSample& a, const ImuSample& b) { return a.stamp_ns < b.stamp_ns; };
  for (std::size_t i = 1; i < samples.size(); ++i) faults.unsorted += earlier(samples[i], samples[i - 1]);
  std::ranges::stable_sort(samples, earlier);
  const auto kept = std::unique(samples.begin(), samples.end(), [](const ImuSample& a, const ImuSample& b) {
    return a.stamp_ns == b.stamp_ns;
  });
  faults.repeated = static_cast<std::size_t>(samples.end() - kept);
  samples.erase(kept, samples.end());
}

/// The largest reading of an axis, if it is the end of the sensor's range: where it was read three times in a
/// row, and at no usual rate or force. Otherwise infinity.
[[nodiscard]] double range_of(const std::vector<ImuSample>& samples, Eigen::Index axis) {
  constexpr double kUsual[] = {2.0, 15.0};  // rad/s, m/s^2
  constexpr int kInRow = 3;
  double largest = 0.0;
  for (const auto& sample : samples) largest = std::max(largest, std::abs(readings_of(sample)[axis]));
  int in_row = 0, longest = 0;
  for (const auto& sample : samples) {
    in_row = std::abs(readings_of(sample)[axis]) == largest ? in_row + 1 : 0;
    longest = std::max(longest, in_row);
  }
  const bool saturates = longest >= kInRow && largest > kUsual[axis / 3];
  return saturates ? largest : std::numeric_limits<double>::infinity();
}

void leave_out_saturated(std::vector<ImuSample>& samples, ImuFaults& faults) {
  antipode::Vector6<double> range;
  for (Eigen::Index axis = 0; axis < 6; ++axis) range[axis] = range_of(samples, axis);
  faults.saturated = std::erase_if(samples, [&](const ImuSample& sample) {
    return (readings_of(sample).cwiseAbs().array() >= range.array()).any();
  });
}

void count_gaps(const std::vector<ImuSample>& samples, ImuFaults& faults) {
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const std::int64_t gap_ns = samples[i].stamp_ns - samples[i - 1].stamp_ns;
    if (gap_ns <= kLongestImuGap_ns) continue;
    ++faults.gaps;
    faults.longest_gap_ns = std::max(faults.longest_gap_ns, gap_ns);
  }
}

}  // namespace

std::vector<std::string> ImuFaults::texts() const {
  std::vector<std::string> texts;
  const auto of_rows = [&](std::size_t count, std::string_view what) {
    if (count > 0) texts.push_back(fmt::format("{} of {} {}", count, counted(rows, "row"), what));
  };
  of_rows(unreadable,
          fmt::format("are not a stamp and six numbers within 100000 and were left out, the first in line {}",
                      first_unreadable));
  of_rows(unsorted, "were earlier than the row before and were sorted");
  of_rows(repeated, "had the stamp of another row and were left out");
  of_rows(saturated, "were at the end of the sensor's range and were left out");
  if (gaps > 0) {
    texts.push_back(
        fmt::format("samples are missing for more than {:.0f} ms {}, at most {:.3g} s; there the "
                    "images are used alone",
                    1e-6 * static_cast<double>(kLongestImuGap_ns), counted(gaps, "time"),
                    1e-9 * static_cast<double>(longest_gap_ns)));
  }
  return texts;
}

ImuSamples read_imu_samples(const std::filesystem::path& file) {
  auto lines = read_text_lines(file);
  if (!lines.empty() && is_heading(lines.front().text)) lines.erase(lines.begin());
  ImuSamples result;
  ImuFaults& faults = result.faults;
  faults.rows = lines.size();
  result.samples.reserve(lines.size());
  for (const auto& line : lines) {
    if (const auto sample = sample_of(line.text)) {
      result.samples.push_back(*sample);
    } else if (faults.unreadable++ == 0) {
      faults.first_unreadable = line.number;
    }
  }
  if (2 * faults.unreadable > faults.rows) {
    fail_at(file, faults.first_unreadable,
            "is not 'stamp in ns, wx, wy, wz in rad/s, ax, ay, az in m/s^2', and so are {} of {} rows",
            faults.unreadable, faults.rows);
  }
  sort_by_stamps(result.samples, faults);
  leave_out_saturated(result.samples, faults);
  if (result.samples.size() < 2) fail(file, "has fewer than two samples of an IMU that can be used");
  count_gaps(result.samples, faults);
  return result;
}

}  // namespace stereo_slam
