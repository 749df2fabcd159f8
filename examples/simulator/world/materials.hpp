// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "simulator/rendering/scene.hpp"

namespace stereo_slam::simulator {

/// The surfaces the world is built of; ids into Scene::materials. Lists hold variants to choose from.
struct Palette {
  MaterialId asphalt{}, kerb{}, grass{}, paint{};
  MaterialId metal{}, glass{}, bark{}, hedge{}, fence{}, forest{}, clouds{};
  std::vector<MaterialId> pavements;
  std::vector<MaterialId> grounds;  ///< patches between the houses
  std::vector<MaterialId> walls;
  std::vector<MaterialId> roofs;
  std::vector<MaterialId> windows;
  std::vector<MaterialId> doors;
  std::vector<MaterialId> shops;
  std::vector<MaterialId> signs;
  std::vector<MaterialId> wheels;
  std::vector<MaterialId> foliage;
};

/// Synthesises all textures from the seed and appends their materials. `size_px` is the side of the large
/// textures, a power of two of at least 64; throws std::invalid_argument otherwise.
[[nodiscard]] Palette make_palette(std::vector<Material>& materials, std::uint64_t seed, int size_px);

/// The same for houses whose windows are all equal, and with pickets of one shape as `fence`.
[[nodiscard]] Palette make_fences_palette(std::vector<Material>& materials, std::uint64_t seed, int size_px);

/// The same with snow on the ground and on the roofs, and plain walls.
[[nodiscard]] Palette make_snow_palette(std::vector<Material>& materials, std::uint64_t seed, int size_px);

/// The same with little texture on the ground nearby: uniform asphalt, gravel beside it, and grass of one
/// colour.
[[nodiscard]] Palette make_highway_palette(std::vector<Material>& materials, std::uint64_t seed, int size_px);

}  // namespace stereo_slam::simulator
