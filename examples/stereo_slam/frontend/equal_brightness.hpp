// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The frame with a right image of the mean and contrast of the left one, where two cameras with exposures of
/// their own differ by more than 15 %: stereo matching compares grey levels. Otherwise the frame itself,
/// without a copy of its pixels. Images that are nearly black or without contrast stay as they are.
[[nodiscard]] StereoFrame with_equal_brightness(const StereoFrame& frame);

}  // namespace stereo_slam
