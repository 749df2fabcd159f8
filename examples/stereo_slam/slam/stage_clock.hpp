// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <vector>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Measures how long the stages of one frame take.
class StageClock {
 public:
  /// Appends to `times`, which it refers to.
  explicit StageClock(std::vector<StageTime>& times) : times_(times) {}

  /// Ends the current stage and names it.
  void lap(const char* stage) {
    const auto now = std::chrono::steady_clock::now();
    times_.push_back({stage, std::chrono::duration<double, std::milli>(now - last_).count()});
    last_ = now;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::vector<StageTime>& times_;
};

}  // namespace stereo_slam
