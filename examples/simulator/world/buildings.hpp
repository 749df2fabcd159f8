// SPDX-License-Identifier: MIT
#pragma once

#include "simulator/textures/random.hpp"
#include "simulator/world/materials.hpp"
#include "simulator/world/mesh.hpp"

namespace stereo_slam::simulator {

/// Outer measures of a house.
struct BuildingSize {
  double width_m = 10.0;  ///< along the street
  double depth_m = 9.0;
  int floors = 2;
};

/// Builds a house of random style: its front is in the plane z = 0 of the mesh's placement, centred at x = 0,
/// its body behind it.
void add_building(Mesh& mesh, Random& random, const Palette& palette, const BuildingSize& size);

}  // namespace stereo_slam::simulator
