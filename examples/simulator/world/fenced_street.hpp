// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "simulator/world/site.hpp"

/// A street on which everything repeats.
namespace stereo_slam::simulator {

/// Picket fences without a gap along both sides of every street, houses behind them, and few lamps and trees.
/// Every picket looks like its neighbour, and with make_fences_palette() every window like any other.
void add_fenced_street(const Site& site, std::vector<Face>& faces);

}  // namespace stereo_slam::simulator
