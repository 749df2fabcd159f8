// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Means of the readings of an IMU over any times: (rate, specific force), which are constant between two
/// samples and their mean. Before the first and after the last sample they are those of that sample.
class ReadingMeans {
 public:
  /// Refers to the samples: at least one, with stamps that increase.
  explicit ReadingMeans(std::span<const ImuSample> samples)
      : samples_(samples), sums_{Vector6<double>::Zero()} {
    for (std::size_t i = 1; i < samples.size(); ++i) {
      const double dt = 1e-9 * static_cast<double>(samples[i].stamp_ns - samples[i - 1].stamp_ns);
      sums_.push_back(sums_.back() + 0.5 * dt * (reading(i) + reading(i - 1)));
    }
  }

  /// The mean from `begin_ns` to `end_ns`, which is later.
  [[nodiscard]] Vector6<double> between(std::int64_t begin_ns, std::int64_t end_ns) const {
    return (sum_until(end_ns) - sum_until(begin_ns)) / (1e-9 * static_cast<double>(end_ns - begin_ns));
  }

  /// The time of the first and of the last sample.
  [[nodiscard]] std::int64_t begin_ns() const { return samples_.front().stamp_ns; }
  [[nodiscard]] std::int64_t end_ns() const { return samples_.back().stamp_ns; }

 private:
  [[nodiscard]] Vector6<double> reading(std::size_t i) const {
    Vector6<double> result;
    result << samples_[i].angular_velocity, samples_[i].specific_force;
    return result;
  }
  /// The integral from the first sample until then.
  [[nodiscard]] Vector6<double> sum_until(std::int64_t stamp_ns) const {
    const auto after = std::ranges::upper_bound(samples_, stamp_ns, {}, &ImuSample::stamp_ns);
    const auto outside = [&](std::size_t i) -> Vector6<double> {
      return sums_[i] + 1e-9 * static_cast<double>(stamp_ns - samples_[i].stamp_ns) * reading(i);
    };
    if (after == samples_.begin()) return outside(0);
    if (after == samples_.end()) return outside(samples_.size() - 1);
    const auto i = static_cast<std::size_t>(after - samples_.begin());
    const double share = static_cast<double>(stamp_ns - samples_[i - 1].stamp_ns) /
                         static_cast<double>(samples_[i].stamp_ns - samples_[i - 1].stamp_ns);
    return sums_[i - 1] + share * (sums_[i] - sums_[i - 1]);
  }

  std::span<const ImuSample> samples_;
  std::vector<Vector6<double>> sums_;
};

}  // namespace stereo_slam
