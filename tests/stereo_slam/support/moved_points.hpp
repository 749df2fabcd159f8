// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/stereo_camera.hpp"

namespace stereo_slam::test {

/// The camera of the tests of what moved points tell.
inline constexpr StereoCamera kMovingCamera{.fx = 700.0,
                                            .fy = 700.0,
                                            .cx = 600.0,
                                            .cy = 180.0,
                                            .baseline_m = 0.5,
                                            .width_px = 1200,
                                            .height_px = 360};

}  // namespace stereo_slam::test
