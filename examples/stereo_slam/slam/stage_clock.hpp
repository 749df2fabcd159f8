// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <vector>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Names and times the stages of one frame.
class StageClock {
 public:
  /// Ends the stage at hand, which has this name.
  void lap(const char* stage) {
    const auto now = std::chrono::steady_clock::now();
    times_.push_back({stage, std::chrono::duration<double, std::milli>(now - last_).count()});
    last_ = now;
  }

  [[nodiscard]] const std::vector<StageTime>& times() const noexcept { return times_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::vector<StageTime> times_;
};

}  // namespace stereo_slam
