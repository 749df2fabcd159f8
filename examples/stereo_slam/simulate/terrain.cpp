// SPDX-License-Identifier: MIT
#include "terrain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "random.hpp"

namespace stereo_slam::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kGridSpacing_m = 12.0;
constexpr int kMaxEvenCells = 200;  ///< along one axis; longer routes get wider cells
constexpr double kFineDistance_m = 22.0;
constexpr double kEvenMargin_m = 60.0;  ///< around the bounding box of the route
constexpr double kWorldMargin_m = 4000.0;
constexpr double kAnchorSpacing_m = 4.0;
constexpr double kAnchorSmoothing_m = 4.0;
/// Beyond the zones of the street by more than a fine triangle.
constexpr double kZoneReach_m = 14.0;
constexpr double kHillBegin_m = 90.0;  ///< distance from the route
constexpr double kHillEnd_m = 1100.0;
constexpr double kHillHeight_m = 95.0;

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

[[nodiscard]] double cross(const GroundPoint& a, const GroundPoint& b) {
  return a.x() * b.y() - a.y() * b.x();
}

[[nodiscard]] double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// Grid lines over [low, high], even inside and growing geometrically outside.
[[nodiscard]] std::vector<double> grid_lines(double low, double high) {
  const double begin = low - kEvenMargin_m;
  const double length = high - low + 2.0 * kEvenMargin_m;
  const int cells = std::clamp(static_cast<int>(std::ceil(length / kGridSpacing_m)), 1, kMaxEvenCells);
  const double spacing = length / cells;
  std::vector<double> lines;
  for (int i = 0; i <= cells; ++i) lines.push_back(begin + i * spacing);
  for (double step = spacing; lines.back() < high + kWorldMargin_m; step *= 1.25)
    lines.push_back(lines.back() + step);
  for (double step = spacing; lines.front() > low - kWorldMargin_m; step *= 1.25) {
    lines.insert(lines.begin(), lines.front() - step);
  }
  return lines;
}

/// Index of the cell that holds x, clamped to the grid.
[[nodiscard]] int locate(const std::vector<double>& lines, double x) {
  const auto after = std::upper_bound(lines.begin(), lines.end(), x);
  return std::clamp(static_cast<int>(after - lines.begin()) - 1, 0, static_cast<int>(lines.size()) - 2);
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

}  // namespace

double Terrain::Triangle::height(const GroundPoint& point) const {
  const GroundPoint e1 = corners[1] - corners[0];
  const GroundPoint e2 = corners[2] - corners[0];
  const GroundPoint e = point - corners[0];
  const double area = cross(e1, e2);
  return heights[0] +
         (cross(e, e2) * (heights[1] - heights[0]) + cross(e1, e) * (heights[2] - heights[0])) / area;
}

Terrain::Terrain(const Route& route, const StreetProfile& profile, std::uint64_t seed)
    : route_(&route), profile_(profile), seed_(seed) {
  const auto stride = static_cast<std::size_t>(kAnchorSpacing_m / Route::kSpacing_m);
  for (std::size_t i = 0; i < route.stations().size(); i += stride) anchors_.push_back(route.stations()[i]);
  xs_ = grid_lines(route.low().x(), route.high().x());
  zs_ = grid_lines(route.low().y(), route.high().y());
  for (const double z : zs_) {
    for (const double x : xs_) heights_.push_back(surface({x, z}));
  }
  const int columns = static_cast<int>(xs_.size()) - 1;
  const int rows = static_cast<int>(zs_.size()) - 1;
  fine_.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const GroundPoint low(xs_[static_cast<std::size_t>(i)], zs_[static_cast<std::size_t>(j)]);
      const GroundPoint high(xs_[static_cast<std::size_t>(i) + 1], zs_[static_cast<std::size_t>(j) + 1]);
      const double reach = kFineDistance_m + 0.5 * (high - low).norm();
      if (route.distance(0.5 * (low + high), reach) < reach) fine_[cell(i, j)].emplace();
    }
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      if (is_fine(i, j)) fine_[cell(i, j)] = fine_heights(i, j);
    }
  }
}

std::size_t Terrain::cell(int i, int j) const {
  return static_cast<std::size_t>(j) * (xs_.size() - 1) + static_cast<std::size_t>(i);
}

bool Terrain::is_fine(int i, int j) const {
  const bool inside =
      i >= 0 && j >= 0 && i + 1 < static_cast<int>(xs_.size()) && j + 1 < static_cast<int>(zs_.size());
  return inside && fine_[cell(i, j)].has_value();
}

double Terrain::surface(const GroundPoint& point) const {
  double sum = 0.0;
  double weights = 0.0;
  double nearest = std::numeric_limits<double>::max();
  for (const Route::Station& anchor : anchors_) {  // Shepard's interpolation
    const double squared = (anchor.position - point).squaredNorm();
    const double softened = squared + kAnchorSmoothing_m * kAnchorSmoothing_m;
    const double weight = 1.0 / (softened * softened);
    sum += weight * anchor.ground_y;
    weights += weight;
    nearest = std::min(nearest, squared);
  }
  const double phase = 2.0 * std::numbers::pi * Random(seed_, 2).uniform();
  const double roll = 0.65 +
                      0.25 * std::sin(0.0051 * point.x() + phase) * std::cos(0.0043 * point.y() - phase) +
                      0.1 * std::sin(0.021 * point.x() - 0.017 * point.y() + phase);
  return sum / weights - kHillHeight_m * roll * smooth_step(kHillBegin_m, kHillEnd_m, std::sqrt(nearest));
}

/// The outline towards coarse neighbours stays straight, so that the surface has no cracks.
Terrain::FineHeights Terrain::fine_heights(int i, int j) const {
  const auto column = static_cast<std::size_t>(i);
  const auto row = static_cast<std::size_t>(j);
  const auto node = [&](std::size_t di, std::size_t dj) {
    return heights_[(row + dj) * xs_.size() + column + di];
  };
  FineHeights heights{};
  for (std::size_t b = 0; b <= kSubdivisions; ++b) {
    for (std::size_t a = 0; a <= kSubdivisions; ++a) {
      const double s = static_cast<double>(a) / kSubdivisions;
      const double t = static_cast<double>(b) / kSubdivisions;
      const auto mix = [](double from, double to, double w) { return (1.0 - w) * from + w * to; };
      if (a == 0 && !is_fine(i - 1, j)) {
        heights[b][a] = mix(node(0, 0), node(0, 1), t);
      } else if (a == kSubdivisions && !is_fine(i + 1, j)) {
        heights[b][a] = mix(node(1, 0), node(1, 1), t);
      } else if (b == 0 && !is_fine(i, j - 1)) {
        heights[b][a] = mix(node(0, 0), node(1, 0), s);
      } else if (b == kSubdivisions && !is_fine(i, j + 1)) {
        heights[b][a] = mix(node(0, 1), node(1, 1), s);
      } else {
        heights[b][a] = surface({mix(xs_[column], xs_[column + 1], s), mix(zs_[row], zs_[row + 1], t)});
      }
    }
  }
  return heights;
}

template <class Visit>
void Terrain::for_triangles(int i, int j, Visit visit) const {
  const auto column = static_cast<std::size_t>(i);
  const auto row = static_cast<std::size_t>(j);
  const auto emit = [&](const GroundPoint& low, const GroundPoint& high, double h00, double h10, double h01,
                        double h11) {
    const GroundPoint p10(high.x(), low.y());
    const GroundPoint p01(low.x(), high.y());
    visit(Triangle{{low, p10, high}, {h00, h10, h11}});
    visit(Triangle{{low, high, p01}, {h00, h11, h01}});
  };
  const GroundPoint origin(xs_[column], zs_[row]);
  const GroundPoint size(xs_[column + 1] - xs_[column], zs_[row + 1] - zs_[row]);
  if (!is_fine(i, j)) {
    const std::size_t n = row * xs_.size() + column;
    emit(origin, origin + size, heights_[n], heights_[n + 1], heights_[n + xs_.size()],
         heights_[n + xs_.size() + 1]);
    return;
  }
  const FineHeights& h = *fine_[cell(i, j)];
  for (std::size_t b = 0; b < kSubdivisions; ++b) {
    for (std::size_t a = 0; a < kSubdivisions; ++a) {
      const auto at = [&](std::size_t da, std::size_t db) {
        return GroundPoint(origin.x() + size.x() * static_cast<double>(a + da) / kSubdivisions,
                           origin.y() + size.y() * static_cast<double>(b + db) / kSubdivisions);
      };
      emit(at(0, 0), at(1, 1), h[b][a], h[b][a + 1], h[b + 1][a], h[b + 1][a + 1]);
    }
  }
}

double Terrain::kerb(const GroundPoint& point) const {
  const bool on_road = route_->distance(point, profile_.road_half_width_m) < profile_.road_half_width_m;
  return on_road ? 0.0 : profile_.kerb_height_m;
}

double Terrain::height(const GroundPoint& point) const {
  double height = 0.0;
  double best = -std::numeric_limits<double>::max();  // the triangle that holds the point, or is nearest to
  for_triangles(locate(xs_, point.x()), locate(zs_, point.y()), [&](const Triangle& triangle) {
    double inside = std::numeric_limits<double>::max();
    for (std::size_t k = 0; k < 3; ++k) {
      const GroundPoint& a = triangle.corners[k];
      inside = std::min(inside, cross(triangle.corners[(k + 1) % 3] - a, point - a));
    }
    if (inside <= best) return;
    best = inside;
    height = triangle.height(point);
  });
  return height - kerb(point);
}

void Terrain::build_zones(const Triangle& triangle, const Palette& palette,
                          const std::vector<Material>& materials, std::vector<Face>& faces) const {
  const Polygon whole(triangle.corners.begin(), triangle.corners.end());
  Triangle distances = triangle;  // the distance to the route, affine over the triangle
  for (std::size_t k = 0; k < 3; ++k)
    distances.heights[k] = route_->distance(triangle.corners[k], kZoneReach_m);
  const auto beyond = [&](double level) {
    return [&distances, level](const GroundPoint& p) { return distances.height(p) - level; };
  };
  const auto within = [&](double level) {
    return [&distances, level](const GroundPoint& p) { return level - distances.height(p); };
  };
  const auto level = [&](const GroundPoint& p) { return triangle.height(p); };
  const auto raised = [&](const GroundPoint& p) { return triangle.height(p) - profile_.kerb_height_m; };
  const double road = profile_.road_half_width_m;
  const double pavement = profile_.pavement_begin_m();
  const double garden = profile_.pavement_end_m();

  add_polygon(clip(whole, within(road)), level, ground_style(palette.asphalt, materials, 0.85F), faces);
  const Polygon outside = clip(whole, beyond(road));
  add_polygon(clip(outside, within(pavement)), raised, ground_style(palette.kerb, materials, 1.15F), faces);
  const Polygon behind = clip(outside, beyond(pavement));
  add_polygon(clip(behind, within(garden)), raised, ground_style(palette.pavements.front(), materials, 1.15F),
              faces);
  add_polygon(clip(behind, beyond(garden)), raised, ground_style(palette.grass, materials, 0.8F), faces);

  // The kerb's upright side: from the point where the outline of the road part leaves the level set to where
  // it comes back, which has the road on its left.
  const Polygon inside = clip(whole, within(road));
  for (std::size_t i = 0; i < inside.size(); ++i) {
    const GroundPoint& from = inside[i];
    const GroundPoint& to = inside[(i + 1) % inside.size()];
    constexpr double kOnLevel_m = 1e-9;
    if (std::abs(beyond(road)(from)) > kOnLevel_m || std::abs(beyond(road)(to)) > kOnLevel_m) continue;
    add_kerb_side(triangle, from, to, ground_style(palette.kerb, materials, 0.8F), faces);
  }
}

void Terrain::add_kerb_side(const Triangle& triangle, const GroundPoint& from, const GroundPoint& to,
                            Face face, std::vector<Face>& faces) const {
  const GroundPoint along = (to - from).normalized() * static_cast<double>(face.u_axis.x());
  face.v_axis = {0.0F, face.u_axis.x(), 0.0F};
  face.u_axis = Vector3d(along.x(), 0.0, along.y()).cast<float>();
  const auto corner = [&](const GroundPoint& p, double lift) -> Eigen::Vector3f {
    return Vector3d(p.x(), triangle.height(p) - lift, p.y()).cast<float>();
  };
  const double top = profile_.kerb_height_m;
  face.corners = {corner(to, 0.0), corner(from, 0.0), corner(from, top), corner(to, top)};
  faces.push_back(face);
}

void Terrain::build(const Palette& palette, const std::vector<Material>& materials,
                    std::vector<Face>& faces) const {
  for (int j = 0; j + 1 < static_cast<int>(zs_.size()); ++j) {
    for (int i = 0; i + 1 < static_cast<int>(xs_.size()); ++i) {
      for_triangles(i, j, [&](const Triangle& triangle) {
        if (is_fine(i, j)) {
          build_zones(triangle, palette, materials, faces);
          return;
        }
        const GroundPoint centre = (triangle.corners[0] + triangle.corners[1] + triangle.corners[2]) / 3.0;
        const bool forest = route_->distance(centre, kHillBegin_m) >= kHillBegin_m;
        add_polygon(
            {triangle.corners.begin(), triangle.corners.end()},
            [&](const GroundPoint& p) { return triangle.height(p) - profile_.kerb_height_m; },
            ground_style(forest ? palette.forest : palette.grass, materials, forest ? 0.75F : 0.8F), faces);
      });
    }
  }
}

void Terrain::drape(const std::vector<GroundPoint>& polygon, const Decal& decal,
                    std::vector<Face>& faces) const {
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
  for (int j = locate(zs_, low.y()); j <= locate(zs_, high.y()); ++j) {
    for (int i = locate(xs_, low.x()); i <= locate(xs_, high.x()); ++i) {
      for_triangles(i, j, [&](const Triangle& triangle) {
        Polygon piece = polygon;
        for (std::size_t k = 0; k < 3 && piece.size() >= 3; ++k) {
          const GroundPoint& a = triangle.corners[k];
          const GroundPoint edge = triangle.corners[(k + 1) % 3] - a;
          piece = clip(piece, [&](const GroundPoint& p) { return cross(edge, p - a); });
        }
        if (piece.size() < 3) return;
        const double kerb_m = kerb(piece.front());
        add_polygon(
            piece, [&](const GroundPoint& p) { return triangle.height(p) - kerb_m - decal.lift_m; }, style,
            faces);
      });
    }
  }
}

}  // namespace stereo_slam::simulate
