// SPDX-License-Identifier: MIT
#include "stereo_slam/imu/imu_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/io/counted.hpp"

namespace stereo_slam {
namespace {

/// The six readings: rate, then specific force.
[[nodiscard]] antipode::Vector6<double> readings_of(const ImuSample& sample) {
  antipode::Vector6<double> readings;
  readings << sample.angular_velocity, sample.specific_force;
  return readings;
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
  const auto of_all = [&](std::size_t count, std::string_view what) {
    if (count > 0) texts.push_back(fmt::format("{} of {} {}", count, counted(records, record), what));
  };
  of_all(unreadable,
         fmt::format("are not a stamp and six numbers within 100000 and were left out, the first in {} {}",
                     place, first_unreadable));
  of_all(unsorted, fmt::format("were earlier than the {} before and were sorted", record));
  of_all(repeated, fmt::format("had the stamp of another {} and were left out", record));
  of_all(saturated, "were at the end of the sensor's range and were left out");
  if (gaps > 0) {
    texts.push_back(
        fmt::format("samples are missing for more than {:.0f} ms {}, at most {:.3g} s; there the "
                    "images are used alone",
                    1e-6 * static_cast<double>(kLongestImuGap_ns), counted(gaps, "time"),
                    1e-9 * static_cast<double>(longest_gap_ns)));
  }
  return texts;
}

ImuSamples usable_samples(std::vector<ImuSample> recorded, const ImuFaults& faults) {
  ImuSamples result{.samples = std::move(recorded), .faults = faults};
  sort_by_stamps(result.samples, result.faults);
  leave_out_saturated(result.samples, result.faults);
  if (result.samples.size() < 2)
    throw std::invalid_argument("has fewer than two samples of an IMU that can be used");
  count_gaps(result.samples, result.faults);
  return result;
}

}  // namespace stereo_slam
