// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "materials.hpp"
#include "route.hpp"
#include "scene.hpp"
#include "terrain.hpp"

/// What stands along the streets, and where.
namespace stereo_slam::simulate {

/// What the builders of a town work with.
struct TownSite {
  const Route& route;
  const Terrain& terrain;
  const StreetProfile& street;
  const Palette& palette;
  const std::vector<Material>& materials;
  std::uint64_t seed = 1;
};

/// Houses with gardens, trees, parked cars and street furniture along both sides of every street.
void add_town(const TownSite& site, std::vector<Face>& faces);

/// Lane markings, zebra crossings, manhole covers, patches of gravel and cobbles.
void add_ground_details(const TownSite& site, std::vector<Face>& faces);

/// Clouds above everything.
void add_sky(const TownSite& site, std::vector<Face>& faces);

}  // namespace stereo_slam::simulate
