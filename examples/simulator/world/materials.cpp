// SPDX-License-Identifier: MIT
#include "simulator/world/materials.hpp"

#include <bit>
#include <memory>
#include <stdexcept>
#include <string>

#include "simulator/textures/pattern.hpp"
#include "simulator/textures/textures.hpp"

namespace stereo_slam::simulator {
namespace {

using TexturePtr = std::shared_ptr<const Texture>;

[[nodiscard]] TexturePtr make_texture(const cv::Mat1f& tile) {
  return std::make_shared<const Texture>(to_bytes(tile));
}

/// Appends materials that share the texture of stains.
class Shelf {
 public:
  Shelf(std::vector<Material>& materials, TexturePtr stains)
      : materials_(materials), stains_(std::move(stains)) {}

  /// Surface textured in metres: `period_m` a side, stained with a period of about `stain_period_m`.
  MaterialId surface(const cv::Mat1f& detail, double period_m, double stain_period_m, float stain_contrast) {
    Material material;
    material.detail = make_texture(detail);
    material.macro = stains_;
    material.period_m = period_m;
    material.macro_scale = period_m / stain_period_m;
    material.macro_contrast = stain_contrast;
    return add(material);
  }

  /// The same on the ground, where shadows fall.
  MaterialId ground(const cv::Mat1f& detail, double period_m, double stain_period_m, float stain_contrast) {
    const MaterialId id = surface(detail, period_m, stain_period_m, stain_contrast);
    materials_[id].takes_shadow = true;
    return id;
  }

  /// Image that is stretched over a face.
  MaterialId image(const cv::Mat1f& detail) {
    Material material;
    material.detail = make_texture(detail);
    return add(material);
  }

  MaterialId add(const Material& material) {
    materials_.push_back(material);
    return static_cast<MaterialId>(materials_.size() - 1);
  }

  Material& operator[](MaterialId id) { return materials_[id]; }

 private:
  std::vector<Material>& materials_;
  TexturePtr stains_;
};

/// `count` images of one kind.
template <class Synthesis>
[[nodiscard]] std::vector<MaterialId> images(Shelf& shelf, Random& random, int count, int size_px,
                                             Synthesis make) {
  std::vector<MaterialId> ids;
  ids.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) ids.push_back(shelf.image(make(random, size_px)));
  return ids;
}

[[nodiscard]] std::vector<MaterialId> make_foliage(Shelf& shelf, Random& random, int size_px) {
  std::vector<MaterialId> ids;
  for (int i = 0; i < 4; ++i) {
    const MaterialId id = shelf.surface(leaf_texture(random, size_px), 2.0, 11.3, 0.4F);
    shelf[id].opacity = make_texture(leaf_opacity(random, size_px));
    shelf[id].two_sided = true;
    ids.push_back(id);
  }
  return ids;
}

/// Appends a material like another one, with its own texture.
MaterialId add_variant(std::vector<Material>& materials, MaterialId like, const cv::Mat1f& detail,
                       float stain_contrast) {
  Material material = materials[like];
  material.detail = make_texture(detail);
  material.macro_contrast = stain_contrast;
  materials.push_back(material);
  return static_cast<MaterialId>(materials.size() - 1);
}

/// The texture with its contrast changed, about a brightness.
[[nodiscard]] cv::Mat1f even(const cv::Mat1f& tile, double contrast, double brightness = 0.5) {
  return brightness + contrast * (tile - 0.5);
}

}  // namespace

Palette make_palette(std::vector<Material>& materials, std::uint64_t seed, int size_px) {
  if (size_px < 64 || !std::has_single_bit(static_cast<unsigned>(size_px))) {
    throw std::invalid_argument("texture size must be a power of two of at least 64 px, not " +
                                std::to_string(size_px));
  }
  Random random(seed, 1);
  Shelf shelf(materials, make_texture(stain_texture(random, size_px)));
  const int half = size_px / 2;
  const int quarter = size_px / 4;

  Palette palette;
  palette.asphalt = shelf.ground(asphalt_texture(random, size_px), 10.24, 47.0, 0.22F);
  palette.kerb = shelf.ground(paving_texture(random, half), 1.9, 13.7, 0.5F);
  palette.grass = shelf.ground(grass_texture(random, size_px), 5.12, 31.0, 0.6F);
  palette.paint = shelf.ground(paint_texture(random, half), 2.56, 17.0, 0.3F);
  palette.pavements = {shelf.ground(paving_texture(random, size_px), 5.12, 29.0, 0.4F)};
  palette.grounds = {shelf.ground(gravel_texture(random, size_px), 5.12, 37.0, 0.4F),
                     shelf.ground(cobble_texture(random, size_px), 5.12, 23.0, 0.4F)};
  palette.walls = {shelf.surface(brick_texture(random, size_px, 64, 20), 5.12, 13.1, 0.35F),
                   shelf.surface(brick_texture(random, size_px, 40, 12), 5.12, 17.3, 0.35F),
                   shelf.surface(plaster_texture(random, size_px), 5.12, 11.9, 0.2F),
                   shelf.surface(plaster_texture(random, size_px), 5.12, 14.3, 0.3F),
                   shelf.surface(masonry_texture(random, size_px), 5.12, 19.7, 0.35F),
                   shelf.surface(boards_texture(random, size_px), 5.12, 16.9, 0.35F)};
  palette.roofs = {shelf.surface(roof_texture(random, size_px), 5.12, 15.1, 0.4F),
                   shelf.surface(roof_texture(random, half), 3.7, 18.3, 0.4F)};
  palette.windows = images(shelf, random, 40, quarter, window_texture);
  palette.doors = images(shelf, random, 16, quarter, door_texture);
  palette.shops = images(shelf, random, 24, quarter, shop_texture);
  palette.signs = images(shelf, random, 64, quarter / 2, sign_texture);
  palette.wheels = images(shelf, random, 3, quarter / 2, wheel_texture);
  palette.metal = shelf.surface(metal_texture(random, half), 2.56, 7.3, 0.3F);
  palette.glass = shelf.surface(glass_texture(random, quarter), 2.56, 5.9, 0.4F);
  palette.bark = shelf.surface(bark_texture(random, quarter), 1.28, 7.7, 0.4F);
  palette.foliage = make_foliage(shelf, random, half);
  palette.hedge = shelf.surface(leaf_texture(random, half), 2.0, 8.3, 0.5F);
  palette.fence = shelf.surface(boards_texture(random, half), 2.56, 9.1, 0.4F);
  shelf[palette.fence].opacity = make_texture(fence_opacity(random, quarter));
  shelf[palette.fence].two_sided = true;
  palette.forest = shelf.surface(forest_texture(random, size_px), 160.0, 730.0, 0.5F);
  palette.clouds = shelf.surface(cloud_texture(random, size_px), 6000.0, 41000.0, 0.05F);
  return palette;
}

Palette make_fences_palette(std::vector<Material>& materials, std::uint64_t seed, int size_px) {
  Palette palette = make_palette(materials, seed, size_px);
  Random random(seed, 9);
  palette.walls = {palette.walls[2]};  // plaster
  palette.windows = {palette.windows.front()};
  palette.shops = {palette.shops.front()};
  palette.doors = {palette.doors.front()};
  palette.fence = add_variant(materials, palette.fence, metal_texture(random, size_px / 2), 0.1F);
  materials[palette.fence].opacity = make_texture(picket_opacity(size_px / 2));
  return palette;
}

Palette make_snow_palette(std::vector<Material>& materials, std::uint64_t seed, int size_px) {
  constexpr double kSnow = 0.85;  // mean brightness
  Palette palette = make_palette(materials, seed, size_px);
  Random random(seed, 10);
  const auto plain = [&](MaterialId like, double brightness) {
    return add_variant(materials, like, even(gravel_texture(random, size_px / 2), 0.06, brightness), 0.06F);
  };
  for (MaterialId* id : {&palette.asphalt, &palette.kerb, &palette.grass}) *id = plain(*id, kSnow);
  for (auto* ids : {&palette.pavements, &palette.grounds, &palette.roofs})
    *ids = {plain(ids->front(), kSnow)};
  palette.walls = {plain(palette.walls[2], 0.55), plain(palette.walls[3], 0.45)};  // plaster
  return palette;
}

Palette make_highway_palette(std::vector<Material>& materials, std::uint64_t seed, int size_px) {
  Palette palette = make_palette(materials, seed, size_px);
  Random random(seed, 8);
  palette.asphalt =
      add_variant(materials, palette.asphalt, even(asphalt_texture(random, size_px), 0.35), 0.12F);
  palette.grass = add_variant(materials, palette.grass, even(grass_texture(random, size_px), 0.4), 0.45F);
  const MaterialId gravel =
      add_variant(materials, palette.grounds.front(), even(gravel_texture(random, size_px), 0.4), 0.3F);
  palette.kerb = gravel;
  palette.pavements = {gravel};
  return palette;
}

}  // namespace stereo_slam::simulator
