// SPDX-License-Identifier: MIT
#include "simulator/world/world.hpp"

#include "simulator/world/fenced_street.hpp"
#include "simulator/world/ground.hpp"
#include "simulator/world/highway.hpp"
#include "simulator/world/shadows.hpp"
#include "simulator/world/town.hpp"

namespace stereo_slam::simulator {

StreetProfile street_profile(Scenery scenery) {
  if (scenery != Scenery::kHighway) return {};
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

namespace {

[[nodiscard]] auto palette_of(Scenery scenery) {
  switch (scenery) {
    case Scenery::kHighway:
      return make_highway_palette;
    case Scenery::kFences:
      return make_fences_palette;
    case Scenery::kSnow:
      return make_snow_palette;
    case Scenery::kTown:
      break;
  }
  return make_palette;
}

}  // namespace

World::World(const CameraPath& path, const WorldSettings& settings)
    : street_(settings.street.value_or(street_profile(settings.scenery))),
      route_(path, settings.camera_height_m, street_.run_out_m),
      terrain_(route_, street_, settings.seed) {
  constexpr double kChunk_m = 24.0;
  const bool highway = settings.scenery == Scenery::kHighway;
  palette_ = palette_of(settings.scenery)(scene_.materials, settings.seed, settings.texture_size_px);
  const Site site{route_, terrain_, street_, palette_, scene_.materials, settings.seed};
  std::vector<Face> faces;
  if (highway) {
    add_highway(site, faces);
  } else if (settings.scenery == Scenery::kFences) {
    add_fenced_street(site, faces);
  } else {
    add_town(site, faces);
  }
  scene_.sunlight = cast_shadows(faces, scene_.materials, terrain_, route_.low(), route_.high());
  add_ground(site, faces);
  if (highway) {
    add_highway_lines(site, faces);
  } else if (settings.scenery != Scenery::kSnow) {
    add_ground_details(site, faces);
  }
  add_sky(site, faces);
  scene_.chunks = make_chunks(faces, kChunk_m);
}

}  // namespace stereo_slam::simulator
