// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "stereo_slam/core/imu_readings.hpp"

namespace stereo_slam {

/// What was wrong with the samples of an IMU as they were recorded: what is left does without them.
struct ImuFaults {
  std::string_view record = "row";   ///< what a sample is in its file: a row, or a message
  std::string_view place = "line";   ///< what is counted to find it
  std::size_t records = 0;           ///< in the file
  std::size_t unreadable = 0;        ///< not a stamp and six finite numbers: left out
  std::size_t first_unreadable = 0;  ///< its place
  std::size_t unsorted = 0;          ///< earlier than the record before: sorted
  std::size_t repeated = 0;          ///< with the stamp of another record: left out
  std::size_t saturated = 0;         ///< at the end of the sensor's range: left out
  std::size_t gaps = 0;              ///< times without samples that are too long to be bridged
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

/// The samples as they were recorded, in order and without those that are repeated or at the end of the
/// sensor's range, which are added to the faults. Throws std::invalid_argument if fewer than two are left.
[[nodiscard]] ImuSamples usable_samples(std::vector<ImuSample> recorded, const ImuFaults& faults);

}  // namespace stereo_slam
