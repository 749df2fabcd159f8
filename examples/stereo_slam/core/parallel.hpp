// SPDX-License-Identifier: MIT
#pragma once

#include <future>

#include <opencv2/core/utility.hpp>

namespace stereo_slam {

/// Calls two functions at the same time on OpenCV's threads, or one after the other if there is one thread.
/// Returns when both have ended. An exception of either reaches the caller.
template <typename First, typename Second>
void run_both(const First& first, const Second& second) {
  cv::parallel_for_(cv::Range(0, 2), [&](const cv::Range& range) {
    if (range.start == 0) first();
    if (range.end == 2) second();
  });
}

/// Calls `first` on a thread of its own, unless OpenCV is to use one thread only, and meanwhile `second` on
/// this one. Unlike in run_both(), loops in `second` are spread over OpenCV's threads, which does not spread
/// loops within a loop; loops in `first` may not be. Returns when both have ended. An exception of either
/// reaches the caller.
template <typename First, typename Second>
void run_beside(const First& first, const Second& second) {
  const bool at_once = cv::getNumThreads() > 1;
  auto ended = std::async(at_once ? std::launch::async : std::launch::deferred, [&first] { first(); });
  second();
  ended.get();
}

}  // namespace stereo_slam
