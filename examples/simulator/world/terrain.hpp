// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "simulator/world/route.hpp"

namespace stereo_slam::simulator {

/// Cross-section of a street, measured from the camera's path, and its traffic. The defaults are a street in
/// a town.
struct StreetProfile {
  double road_half_width_m = 5.2;
  double kerb_width_m = 0.15;
  double kerb_height_m = 0.12;
  double pavement_width_m = 2.4;
  double forest_begin_m = 90.0;  ///< distance from the path; grass up to there
  double run_out_m = Route::kRunOut_m;
  double oncoming_lane_m = 2.35;  ///< to the left of the path
  double least_gap_m = 11.0;      ///< from the camera to the vehicle ahead
  double slowest_m_s = 6.0;       ///< bounds of the speed of oncoming vehicles
  double fastest_m_s = 11.0;

  [[nodiscard]] double pavement_begin_m() const { return road_half_width_m + kerb_width_m; }
  [[nodiscard]] double pavement_end_m() const { return pavement_begin_m() + pavement_width_m; }
};

/// Triangle of the ground; its height is affine in (x, z).
struct GroundTriangle {
  std::array<GroundPoint, 3> corners;  ///< counter-clockwise in (x, z)
  std::array<double, 3> heights;       ///< world y

  [[nodiscard]] double height(const GroundPoint& point) const;
};

/// Two-dimensional cross product of directions on the ground; positive when b is on the left of a, with x to
/// the right and z up.
[[nodiscard]] inline double cross(const GroundPoint& a, const GroundPoint& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Ground of the world: a triangulated height field below the route, fine near it, that rises to hills far
/// away. Off the road it is raised by the kerb's height.
class Terrain {
 public:
  Terrain(const Route& route, const StreetProfile& profile, std::uint64_t seed);

  /// World y of the ground, kerb included.
  [[nodiscard]] double height(const GroundPoint& point) const;

  /// Height of the ground at a point above the triangles, m: the kerb's height off the road, else 0.
  [[nodiscard]] double kerb(const GroundPoint& point) const;

  /// Called with a triangle, and whether it is a fine one near the route. Triangles do not contain the kerb.
  using Visit = std::function<void(const GroundTriangle&, bool is_fine)>;
  void for_each_triangle(const Visit& visit) const;
  /// Visits only the triangles of cells that meet the rectangle from `low` to `high`.
  void for_triangles_in(const GroundPoint& low, const GroundPoint& high, const Visit& visit) const;

 private:
  static constexpr int kSubdivisions = 4;
  using FineHeights = std::array<std::array<double, kSubdivisions + 1>, kSubdivisions + 1>;

  [[nodiscard]] double surface(const GroundPoint& point) const;  ///< the height field that is triangulated
  [[nodiscard]] std::size_t cell(int i, int j) const;
  [[nodiscard]] bool is_fine(int i, int j) const;
  [[nodiscard]] FineHeights fine_heights(int i, int j) const;
  void for_triangles_of_cell(int i, int j, const Visit& visit) const;

  const Route* route_;
  StreetProfile profile_;
  std::uint64_t seed_;
  std::vector<Route::Station> anchors_;  ///< thinned stations that the height field follows
  std::vector<double> xs_, zs_;          ///< grid lines: even near the route, wider and wider away from it
  std::vector<double> heights_;          ///< of the nodes, row-major in z
  std::vector<std::optional<FineHeights>> fine_;  ///< of the cells near the route
};

}  // namespace stereo_slam::simulator
