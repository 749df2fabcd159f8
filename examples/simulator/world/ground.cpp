// SPDX-License-Identifier: MIT
#include "simulator/world/ground.hpp"

#include <cmath>

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

/// Distances to the route are limited to this: farther than any zone of the street by more than a fine
/// triangle.
constexpr double kZoneReach_m = 14.0;

using Polygon = std::vector<GroundPoint>;

/// Part of a convex polygon where the affine function `value` is >= 0.
template <class Value>
[[nodiscard]] Polygon clip(const Polygon& polygon, Value value) {
  Polygon clipped;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const GroundPoint& a = polygon[i];
    const GroundPoint& b = polygon[(i + 1) % polygon.size()];
    const double value_a = value(a);
    const double value_b = value(b);
    if (value_a >= 0.0) clipped.push_back(a);
    if ((value_a >= 0.0) != (value_b >= 0.0)) clipped.push_back(a + value_a / (value_a - value_b) * (b - a));
  }
  return clipped;
}

/// Appends a polygon of the ground as faces of at most four corners.
template <class Height>
void add_polygon(const Polygon& polygon, Height height, const Face& style, std::vector<Face>& faces) {
  const auto corner = [&](std::size_t i) -> Eigen::Vector3f {
    return Vector3d(polygon[i].x(), height(polygon[i]), polygon[i].y()).cast<float>();
  };
  for (std::size_t i = 1; i + 1 < polygon.size(); i += 2) {
    Face face = style;
    face.corner_count = i + 2 < polygon.size() ? 4 : 3;
    face.corners[0] = corner(0);
    for (std::size_t k = 1; k < static_cast<std::size_t>(face.corner_count); ++k)
      face.corners[k] = corner(i + k - 1);
    faces.push_back(face);
  }
}

/// Look of a part of the ground, textured in metres of the world so that neighbours fit together.
[[nodiscard]] Face ground_style(MaterialId id, const std::vector<Material>& materials, float brightness) {
  const auto scale = static_cast<float>(1.0 / materials[id].period_m);
  Face style;
  style.material = id;
  style.brightness = brightness;
  style.u_axis = {scale, 0.0F, 0.0F};
  style.v_axis = {0.0F, 0.0F, scale};
  return style;
}

/// Upright side of the kerb between two points of a triangle; the road is on the left from `from` to
/// `to`.
void add_kerb_side(const Site& site, const GroundTriangle& triangle, const GroundPoint& from,
                   const GroundPoint& to, std::vector<Face>& faces) {
  const double scale = 1.0 / site.materials[site.palette.kerb].period_m;
  const GroundPoint along = scale * (to - from).normalized();
  Face face;
  face.material = site.palette.kerb;
  face.brightness = 0.8F;
  face.u_axis = Vector3d(along.x(), 0.0, along.y()).cast<float>();
  face.v_axis = Vector3d(0.0, scale, 0.0).cast<float>();
  const auto corner = [&](const GroundPoint& p, double lift) -> Eigen::Vector3f {
    return Vector3d(p.x(), triangle.height(p) - lift, p.y()).cast<float>();
  };
  const double top = site.street.kerb_height_m;
  face.corners = {corner(to, 0.0), corner(from, 0.0), corner(from, top), corner(to, top)};
  faces.push_back(face);
}

/// Road, kerb, pavement and grass of one triangle.
void add_zones(const Site& site, const GroundTriangle& triangle, std::vector<Face>& faces) {
  GroundTriangle distances = triangle;  // the distance to the route, affine over the triangle
  for (std::size_t k = 0; k < 3; ++k)
    distances.heights[k] = site.route.distance(triangle.corners[k], kZoneReach_m);
  const auto within = [&](double limit) {
    return [&distances, limit](const GroundPoint& p) { return limit - distances.height(p); };
  };
  const auto beyond = [&](double limit) {
    return [&distances, limit](const GroundPoint& p) { return distances.height(p) - limit; };
  };
  const auto add = [&](const Polygon& polygon, double lift, MaterialId material, float brightness) {
    add_polygon(
        polygon, [&](const GroundPoint& p) { return triangle.height(p) - lift; },
        ground_style(material, site.materials, brightness), faces);
  };
  const Palette& palette = site.palette;
  const double raised = site.street.kerb_height_m;
  const double road = site.street.road_half_width_m;
  const double pavement = site.street.pavement_begin_m();
  const double garden = site.street.pavement_end_m();

  const Polygon whole(triangle.corners.begin(), triangle.corners.end());
  const Polygon inside = clip(whole, within(road));
  const Polygon outside = clip(whole, beyond(road));
  const Polygon behind = clip(outside, beyond(pavement));
  add(inside, 0.0, palette.asphalt, 0.95F);
  add(clip(outside, within(pavement)), raised, palette.kerb, 1.15F);
  add(clip(behind, within(garden)), raised, palette.pavements.front(), 1.15F);
  add(clip(behind, beyond(garden)), raised, palette.grass, 0.8F);

  if (raised == 0.0) return;
  // The edge of the road: the side of its polygon on which the distance is the road's half width.
  for (std::size_t i = 0; i < inside.size(); ++i) {
    const GroundPoint& from = inside[i];
    const GroundPoint& to = inside[(i + 1) % inside.size()];
    constexpr double kOnEdge_m = 1e-9;
    if (within(road)(from) < kOnEdge_m && within(road)(to) < kOnEdge_m)
      add_kerb_side(site, triangle, from, to, faces);
  }
}

}  // namespace

void add_ground(const Site& site, std::vector<Face>& faces) {
  site.terrain.for_each_triangle([&](const GroundTriangle& triangle, bool is_fine) {
    if (is_fine) {
      add_zones(site, triangle, faces);
      return;
    }
    const GroundPoint centre = (triangle.corners[0] + triangle.corners[1] + triangle.corners[2]) / 3.0;
    const double forest_begin = site.street.forest_begin_m;
    const bool forest = site.route.distance(centre, forest_begin) >= forest_begin;
    add_polygon(
        {triangle.corners.begin(), triangle.corners.end()},
        [&](const GroundPoint& p) { return triangle.height(p) - site.street.kerb_height_m; },
        ground_style(forest ? site.palette.forest : site.palette.grass, site.materials, 0.8F), faces);
  });
}

void drape(const Site& site, const std::vector<GroundPoint>& polygon, const Decal& decal,
           std::vector<Face>& faces) {
  GroundPoint low = polygon.front();
  GroundPoint high = polygon.front();
  for (const GroundPoint& point : polygon) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  Face style;
  style.material = decal.material;
  style.brightness = static_cast<float>(decal.brightness);
  const GroundPoint v = decal.along / decal.period_m;
  style.u_axis = Vector3d(v.y(), 0.0, -v.x()).cast<float>();
  style.v_axis = Vector3d(v.x(), 0.0, v.y()).cast<float>();
  site.terrain.for_triangles_in(low, high, [&](const GroundTriangle& triangle, bool) {
    Polygon piece = polygon;
    for (std::size_t k = 0; k < 3; ++k) {
      const GroundPoint& a = triangle.corners[k];
      const GroundPoint edge = triangle.corners[(k + 1) % 3] - a;
      piece = clip(piece, [&](const GroundPoint& p) { return cross(edge, p - a); });
    }
    if (piece.size() < 3) return;
    const double lift = site.terrain.kerb(piece.front()) + decal.lift_m;
    add_polygon(
        piece, [&](const GroundPoint& p) { return triangle.height(p) - lift; }, style, faces);
  });
}

}  // namespace stereo_slam::simulator
