// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "simulator/world/site.hpp"

/// Places objects and road markings along a highway.
namespace stereo_slam::simulator {

/// Guard rails, delineators, signs and gantries beside the carriageway; bushes, trees and hedges behind,
/// farms in the distance.
void add_highway(const Site& site, std::vector<Face>& faces);

/// Edges of the carriageway and borders of its lanes.
void add_highway_lines(const Site& site, std::vector<Face>& faces);

}  // namespace stereo_slam::simulator
