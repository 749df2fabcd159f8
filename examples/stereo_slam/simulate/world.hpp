// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "camera_path.hpp"
#include "materials.hpp"
#include "route.hpp"
#include "scene.hpp"
#include "terrain.hpp"

namespace stereo_slam::simulate {

struct WorldSettings {
  std::uint64_t seed = 1;
  double camera_height_m = 1.65;  ///< of the camera above the road
  int texture_size_px = 1024;     ///< side of the large textures, a power of two
  StreetProfile street;
};

/// A town around a camera path: ground, streets with their markings, houses, gardens, trees, parked cars,
/// hills and clouds. Nothing but the road is on the path. The same path and settings give the same world, bit
/// for bit.
class World {
 public:
  /// Throws std::invalid_argument for an empty path or a wrong texture size.
  World(const CameraPath& path, const WorldSettings& settings);

  [[nodiscard]] const Scene& scene() const noexcept { return scene_; }
  [[nodiscard]] const Route& route() const noexcept { return route_; }
  [[nodiscard]] const Terrain& terrain() const noexcept { return terrain_; }
  [[nodiscard]] const Palette& palette() const noexcept { return palette_; }

  World(const World&) = delete;  // the terrain refers to the route
  World& operator=(const World&) = delete;

 private:
  Route route_;
  Terrain terrain_;
  Scene scene_;
  Palette palette_;
};

}  // namespace stereo_slam::simulate
