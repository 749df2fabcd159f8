// SPDX-License-Identifier: MIT
#include "simulator/world/world.hpp"

#include "simulator/world/ground.hpp"
#include "simulator/world/highway.hpp"
#include "simulator/world/shadows.hpp"
#include "simulator/world/town.hpp"

namespace stereo_slam::simulator {

StreetProfile street_profile(Scenery scenery) {
  if (scenery == Scenery::kTown) return {};
  return {.road_half_width_m = 8.0,
          .kerb_width_m = 0.3,
          .kerb_height_m = 0.0,
          .pavement_width_m = 0.9,
          .forest_begin_m = 180.0,
          .run_out_m = 500.0,
          .oncoming_lane_m = 5.4,
          .least_gap_m = 30.0,
          .slowest_m_s = 22.0,
          .fastest_m_s = 30.0};
}

World::World(const CameraPath& path, const WorldSettings& settings)
    : street_(settings.street.value_or(street_profile(settings.scenery))),
      route_(path, settings.camera_height_m, street_.run_out_m),
      terrain_(route_, street_, settings.seed) {
  constexpr double kChunk_m = 24.0;
  const bool town = settings.scenery == Scenery::kTown;
  const auto make = town ? make_palette : make_highway_palette;
  palette_ = make(scene_.materials, settings.seed, settings.texture_size_px);
  const Site site{route_, terrain_, street_, palette_, scene_.materials, settings.seed};
  std::vector<Face> faces;
  const auto add_surroundings = town ? add_town : add_highway;
  add_surroundings(site, faces);
  scene_.sunlight = cast_shadows(faces, scene_.materials, terrain_, route_.low(), route_.high());
  add_ground(site, faces);
  const auto add_markings = town ? add_ground_details : add_highway_lines;
  add_markings(site, faces);
  add_sky(site, faces);
  scene_.chunks = make_chunks(faces, kChunk_m);
}

}  // namespace stereo_slam::simulator
