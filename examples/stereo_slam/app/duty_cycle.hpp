// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>

namespace stereo_slam {

/// Limits repeated work to a share of the time: each piece of work is followed by a pause in proportion to
/// its duration.
class DutyCycle {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `share` of the time for the work, above 0 and at most 1.
  explicit DutyCycle(double share) : share_(share) {}

  [[nodiscard]] bool is_due(Time now) const { return now >= next_; }
  void worked(Time begin, Time end) {
    const std::chrono::duration<double> pause = (end - begin) * (1.0 / share_ - 1.0);
    next_ = end + std::chrono::duration_cast<Time::duration>(pause);
  }

 private:
  double share_;
  Time next_ = Time::min();
};

}  // namespace stereo_slam
