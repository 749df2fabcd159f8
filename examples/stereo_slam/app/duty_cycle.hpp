// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>

namespace stereo_slam {

/// When to do work that may take at most a share of the time: after work of a length there is a pause in
/// proportion to it.
class DutyCycle {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `share` above 0 and at most 1.
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
