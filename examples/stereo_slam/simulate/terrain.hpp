// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "materials.hpp"
#include "route.hpp"
#include "scene.hpp"

namespace stereo_slam::simulate {

/// Widths of the cross-section of a street, measured from the camera's path.
struct StreetProfile {
  double road_half_width_m = 5.2;
  double kerb_width_m = 0.15;
  double kerb_height_m = 0.12;
  double pavement_width_m = 2.4;

  [[nodiscard]] double pavement_begin_m() const { return road_half_width_m + kerb_width_m; }
  [[nodiscard]] double pavement_end_m() const { return pavement_begin_m() + pavement_width_m; }
};

/// Ground of the world: a triangulated height field below the route, fine near it, that rises to hills far
/// away. Its zones (road, kerb, pavement, grass, forest) are level sets of the distance to the route, so that
/// crossings and repeated passes of the camera merge into one street.
class Terrain {
 public:
  Terrain(const Route& route, const StreetProfile& profile, std::uint64_t seed);

  /// World y of the triangulated surface, kerb included.
  [[nodiscard]] double height(const GroundPoint& point) const;

  /// Appends the ground itself.
  void build(const Palette& palette, const std::vector<Material>& materials, std::vector<Face>& faces) const;

  /// Flat thing on the ground: material, light, and how far above the surface it lies. The texture is laid in
  /// metres, turned so that v runs along `along`.
  struct Decal {
    MaterialId material{};
    double period_m = 1.0;
    double brightness = 1.0;
    double lift_m = 0.01;
    GroundPoint along = GroundPoint::UnitY();
  };
  /// Appends a convex polygon (counter-clockwise in (x, z)) that follows the surface.
  void drape(const std::vector<GroundPoint>& polygon, const Decal& decal, std::vector<Face>& faces) const;

 private:
  static constexpr int kSubdivisions = 4;
  using FineHeights = std::array<std::array<double, kSubdivisions + 1>, kSubdivisions + 1>;

  struct Triangle {
    std::array<GroundPoint, 3> corners;  ///< counter-clockwise in (x, z)
    std::array<double, 3> heights;
    [[nodiscard]] double height(const GroundPoint& point) const;
  };

  [[nodiscard]] double surface(const GroundPoint& point) const;  ///< the height field that is triangulated
  [[nodiscard]] double kerb(const GroundPoint& point) const;
  [[nodiscard]] std::size_t cell(int i, int j) const;
  [[nodiscard]] bool is_fine(int i, int j) const;
  [[nodiscard]] FineHeights fine_heights(int i, int j) const;
  /// Calls visit(triangle, near_route) for the triangles of cell (i, j).
  template <class Visit>
  void for_triangles(int i, int j, Visit visit) const;
  void build_zones(const Triangle& triangle, const Palette& palette, const std::vector<Material>& materials,
                   std::vector<Face>& faces) const;
  void add_kerb_side(const Triangle& triangle, const GroundPoint& from, const GroundPoint& to, Face face,
                     std::vector<Face>& faces) const;

  const Route* route_;
  StreetProfile profile_;
  std::uint64_t seed_;
  std::vector<Route::Station> anchors_;  ///< thinned stations that the height field follows
  std::vector<double> xs_, zs_;          ///< grid lines: even near the route, wider and wider away from it
  std::vector<double> heights_;          ///< of the nodes, row-major in z
  std::vector<std::optional<FineHeights>> fine_;  ///< of the cells near the route
};

}  // namespace stereo_slam::simulate
