// SPDX-License-Identifier: MIT
#include "world.hpp"

#include "ground.hpp"
#include "shadows.hpp"
#include "town.hpp"

namespace stereo_slam::simulate {

World::World(const CameraPath& path, const WorldSettings& settings)
    : route_(path, settings.camera_height_m), terrain_(route_, settings.street, settings.seed) {
  constexpr double kChunk_m = 24.0;
  palette_ = make_palette(scene_.materials, settings.seed, settings.texture_size_px);
  const TownSite site{route_, terrain_, settings.street, palette_, scene_.materials, settings.seed};
  std::vector<Face> faces;
  add_town(site, faces);
  scene_.sunlight = cast_shadows(faces, scene_.materials, terrain_, route_.low(), route_.high());
  add_ground(site, faces);
  add_ground_details(site, faces);
  add_sky(site, faces);
  scene_.chunks = make_chunks(faces, kChunk_m);
}

}  // namespace stereo_slam::simulate
