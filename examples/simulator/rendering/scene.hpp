// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "simulator/textures/texture.hpp"

namespace stereo_slam::simulator {

/// Appearance of a surface: grey = 255 * brightness * detail(u, v) * (1 + macro_contrast * (2 macro(s u, s v)
/// - 1)).
///
/// `detail` is the fine structure, repeated; `macro` breaks the repetition: its period is incommensurate with
/// the detail's. `opacity`, where given, cuts holes (foliage, fences); it shares the detail's coordinates.
struct Material {
  std::shared_ptr<const Texture> detail;
  std::shared_ptr<const Texture> macro;
  std::shared_ptr<const Texture> opacity;
  double macro_scale = 0.13;  ///< s: macro periods in one detail period
  float macro_contrast = 0.35F;
  double period_m = 5.12;  ///< side of the detail texture on surfaces that are textured in metres
  bool two_sided = false;
  bool takes_shadow = false;  ///< whether Scene::sunlight falls on it
};

/// Sunlight that reaches the ground: a texture over a square of the (x, z) plane, 0 in full shadow, 1 in full
/// sun.
struct Sunlight {
  std::shared_ptr<const Texture> map;                ///< none is sun everywhere
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  ///< smallest x and z
  double side_m = 1.0;
  float shadow = 0.4F;  ///< light that is left in full shadow
};

using MaterialId = std::uint16_t;

/// Planar convex polygon with texture coordinates that are affine in the position: u = u_axis . p + u_offset.
///
/// Corners run counter-clockwise seen from the front; only the front is visible unless the material is
/// two-sided. World coordinates, metres; texture coordinates in periods.
struct Face {
  std::array<Eigen::Vector3f, 4> corners;
  int corner_count = 4;
  Eigen::Vector3f u_axis = Eigen::Vector3f::Zero();
  Eigen::Vector3f v_axis = Eigen::Vector3f::Zero();
  float u_offset = 0.0F;
  float v_offset = 0.0F;
  float brightness = 1.0F;  ///< albedo times light
  MaterialId material = 0;
};

/// Neighbouring faces that are culled together.
struct Chunk {
  Eigen::AlignedBox3f bounds;
  std::vector<Face> faces;
};

/// Everything static that can be rendered. Grey levels are on the scale 0 .. 255 of the image.
struct Scene {
  std::vector<Material> materials;
  std::vector<Chunk> chunks;
  Sunlight sunlight;
  float horizon_grey = 215.0F;      ///< of the far distance and of whatever no face covers
  double haze_distance_m = 4000.0;  ///< at which half of the light is haze
};

/// Sorts faces into chunks of `size_m` metres on the ground; faces larger than a chunk go together.
[[nodiscard]] std::vector<Chunk> make_chunks(const std::vector<Face>& faces, double size_m);

/// Bounding box of a set of faces.
[[nodiscard]] Eigen::AlignedBox3f bounding_box(const std::vector<Face>& faces);

}  // namespace stereo_slam::simulator
