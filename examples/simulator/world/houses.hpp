// SPDX-License-Identifier: MIT
#pragma once

#include "simulator/world/roadside.hpp"

namespace stereo_slam::simulator {

/// One row of houses along both sides of the street, some with gardens; `row_offset_m` is 0 for the row at
/// the street, and larger for rows behind it.
void add_houses(Yard& yard, double row_offset_m);

}  // namespace stereo_slam::simulator
