// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

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

/// Calls a function with each number below `count`, in any order, on OpenCV's threads. Returns when all calls
/// have ended. An exception of one reaches the caller.
template <typename Function>
void run_each(std::size_t count, const Function& function) {
  cv::parallel_for_(cv::Range(0, static_cast<int>(count)), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) function(static_cast<std::size_t>(i));
  });
}

/// Lowers the priority of the calling thread, for work that is not urgent: reading frames ahead, closing
/// loops. Does nothing on systems other than Linux.
void lower_thread_priority();

}  // namespace stereo_slam
