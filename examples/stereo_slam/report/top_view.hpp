// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>

#include "stereo_slam/results/output.hpp"

namespace stereo_slam::report {

/// Writes the path of the camera seen from above as a <figure> of legend and SVG: x to the right, z upwards,
/// both of the first camera. It shows the path coloured by status, the path without loop closure, the loops,
/// ellipses of one standard deviation and the landmarks.
void write_top_view(std::ostream& stream, const RunRecord& record);

}  // namespace stereo_slam::report
