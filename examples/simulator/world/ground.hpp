// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "simulator/world/town.hpp"

namespace stereo_slam::simulator {

/// Appends the surface of the ground: road, kerb, pavement, grass and forest. Their outlines are level sets
/// of the distance to the route, so that crossings and repeated passes of the camera merge into one street.
void add_ground(const Site& site, std::vector<Face>& faces);

/// Flat object that lies on the ground. Its texture is in metres, with v along `along`.
struct Decal {
  MaterialId material{};
  double period_m = 1.0;
  double brightness = 1.0;
  double lift_m = 0.01;  ///< above the surface
  GroundPoint along = GroundPoint::UnitY();
};

/// Appends a convex polygon, counter-clockwise in (x, z), that follows the ground.
void drape(const Site& site, const std::vector<GroundPoint>& polygon, const Decal& decal,
           std::vector<Face>& faces);

}  // namespace stereo_slam::simulator
