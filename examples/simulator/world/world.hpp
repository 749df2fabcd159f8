// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "simulator/rendering/scene.hpp"
#include "simulator/world/camera_path.hpp"
#include "simulator/world/materials.hpp"
#include "simulator/world/route.hpp"
#include "simulator/world/terrain.hpp"

namespace stereo_slam::simulator {

/// What is built along the path.
enum class Scenery {
  kTown,     ///< houses at the kerb: most visible points are near
  kHighway,  ///< a wide carriageway through fields: most visible points are far
  kFences,   ///< a street between picket fences, with houses whose windows are all equal
  kSnow,     ///< the town under snow, with plain walls: little texture
};

/// The usual cross-section of the street in a scenery.
[[nodiscard]] StreetProfile street_profile(Scenery scenery);

struct WorldSettings {
  Scenery scenery = Scenery::kTown;
  std::uint64_t seed = 1;
  double camera_height_m = 1.65;        ///< of the camera above the road
  int texture_size_px = 1024;           ///< side of the large textures, a power of two
  std::optional<StreetProfile> street;  ///< nothing: street_profile(scenery)
};

/// What surrounds a camera path: ground, hills and clouds, and a town with its streets, houses, gardens,
/// trees and parked cars, a street between fences, or a highway with its rails, signs, bushes and woods. No
/// object stands on the path.
/// The same path and settings give the same world, bit for bit.
class World {
 public:
  /// Throws std::invalid_argument for an empty path or a wrong texture size.
  World(const CameraPath& path, const WorldSettings& settings);

  [[nodiscard]] const Scene& scene() const noexcept { return scene_; }
  [[nodiscard]] const Route& route() const noexcept { return route_; }
  [[nodiscard]] const Terrain& terrain() const noexcept { return terrain_; }
  [[nodiscard]] const StreetProfile& street() const noexcept { return street_; }
  [[nodiscard]] const Palette& palette() const noexcept { return palette_; }

  World(const World&) = delete;  // the terrain refers to the route
  World& operator=(const World&) = delete;

 private:
  StreetProfile street_;
  Route route_;
  Terrain terrain_;
  Scene scene_;
  Palette palette_;
};

}  // namespace stereo_slam::simulator
