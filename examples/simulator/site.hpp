// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "simulator/materials.hpp"
#include "simulator/route.hpp"
#include "simulator/scene.hpp"
#include "simulator/terrain.hpp"

namespace stereo_slam::simulate {

/// What the builders of a world work with.
struct Site {
  const Route& route;
  const Terrain& terrain;
  const StreetProfile& street;
  const Palette& palette;
  const std::vector<Material>& materials;
  std::uint64_t seed = 1;
};

}  // namespace stereo_slam::simulate
