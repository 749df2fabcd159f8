// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "stereo_slam/core/imu_readings.hpp"

namespace stereo_slam {

/// What was wrong with the rows of a file of IMU samples: the samples do without them.
struct ImuFaults {
  std::size_t rows = 0;        ///< of the file
  std::size_t unreadable = 0;  ///< not a stamp and six finite numbers: left out
  int first_unreadable = 0;    ///< its line
  std::size_t unsorted = 0;    ///< earlier than the row before: sorted
  std::size_t repeated = 0;    ///< with the stamp of another row: left out
  std::size_t saturated = 0;   ///< at the end of the sensor's range: left out
  std::size_t gaps = 0;        ///< times without samples that are too long to be bridged
  std::int64_t longest_gap_ns = 0;

  /// Each kind of fault that occurs, with its number.
  [[nodiscard]] std::vector<std::string> texts() const;
};

/// Samples whose stamps increase.
struct ImuSamples {
  std::vector<ImuSample> samples;
  ImuFaults faults;
};

/// The longest time between two samples over which readings are interpolated; that of the library.
inline constexpr std::int64_t kLongestImuGap_ns = 30'000'000;

/// Reads rows of `stamp, wx, wy, wz [rad/s], ax, ay, az [m/s^2]`, with more columns or without: the data.csv
/// of EuRoC. Stamps are whole nanoseconds, or seconds with a decimal point. A heading is left out.
///
/// Throws std::runtime_error if the file cannot be read, if more than half of the rows are unreadable, or if
/// fewer than two samples are left.
[[nodiscard]] ImuSamples read_imu_samples(const std::filesystem::path& file);

}  // namespace stereo_slam
