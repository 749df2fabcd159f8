// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "simulator/rendering/scene.hpp"
#include "simulator/world/terrain.hpp"

namespace stereo_slam::simulator {

/// Unit direction from the ground to the sun, world axes.
[[nodiscard]] Eigen::Vector3d direction_to_sun();

/// Map of the sunlight on the terrain with the shadows of all `faces`. Faces with holes, such as leaves, cast
/// smaller shadows. The map covers the rectangle from `low` to `high` and a margin.
[[nodiscard]] Sunlight cast_shadows(const std::vector<Face>& faces, const std::vector<Material>& materials,
                                    const Terrain& terrain, const GroundPoint& low, const GroundPoint& high);

}  // namespace stereo_slam::simulator
