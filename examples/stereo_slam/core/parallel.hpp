// SPDX-License-Identifier: MIT
#pragma once

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

}  // namespace stereo_slam
