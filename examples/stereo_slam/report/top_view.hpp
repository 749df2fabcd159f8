// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>

#include "stereo_slam/results/output.hpp"

namespace stereo_slam::report {

/// The way of the camera, seen from above: x to the right, z upwards, both of the first camera. A <figure> of
/// legend and SVG with the path coloured by status, the path without loops, the loops, ellipses of one
/// standard deviation, and the landmarks around.
void write_top_view(std::ostream& stream, const RunRecord& record);

}  // namespace stereo_slam::report
