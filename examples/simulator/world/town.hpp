// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "simulator/world/site.hpp"

/// Places objects along the streets of a town, details on the ground, and the sky.
namespace stereo_slam::simulator {

/// Houses with gardens, trees, parked cars and street furniture along both sides of every street.
void add_town(const Site& site, std::vector<Face>& faces);

/// Lane markings, zebra crossings, manhole covers, patches of gravel and cobbles.
void add_ground_details(const Site& site, std::vector<Face>& faces);

/// Clouds above everything.
void add_sky(const Site& site, std::vector<Face>& faces);

}  // namespace stereo_slam::simulator
