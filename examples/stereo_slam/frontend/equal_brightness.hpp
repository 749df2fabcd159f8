// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The frame with a right image as bright and as contrasty as the left one, where two cameras with exposures
/// of their own differ by more than 15 %: stereo matching compares grey levels. Otherwise the frame itself,
/// without a copy of its pixels. The medians over 8 x 4 tiles decide, so that a part that only one camera
/// sees does not count. Tiles that are nearly black or plain are left out; if most are, the frame stays as it
/// is.
[[nodiscard]] StereoFrame with_equal_brightness(const StereoFrame& frame);

}  // namespace stereo_slam
