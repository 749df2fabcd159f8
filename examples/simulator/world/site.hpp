// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "simulator/rendering/scene.hpp"
#include "simulator/world/materials.hpp"
#include "simulator/world/route.hpp"
#include "simulator/world/terrain.hpp"

namespace stereo_slam::simulator {

/// Inputs of the functions that build a world.
struct Site {
  const Route& route;
  const Terrain& terrain;
  const StreetProfile& street;
  const Palette& palette;
  const std::vector<Material>& materials;
  std::uint64_t seed = 1;
};

}  // namespace stereo_slam::simulator
