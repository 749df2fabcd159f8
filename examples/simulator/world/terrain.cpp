// SPDX-License-Identifier: MIT
#include "simulator/world/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "simulator/textures/random.hpp"

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

constexpr double kGridSpacing_m = 12.0;
constexpr int kMaxEvenCells = 200;  ///< along one axis; longer routes get wider cells
constexpr double kFineDistance_m = 22.0;
constexpr double kEvenMargin_m = 60.0;  ///< around the bounding box of the route
constexpr double kWorldMargin_m = 4000.0;
constexpr double kAnchorSpacing_m = 4.0;
constexpr double kAnchorSmoothing_m = 4.0;
constexpr double kHillBegin_m = 90.0;  ///< distance from the route
constexpr double kHillEnd_m = 1100.0;
constexpr double kHillHeight_m = 95.0;

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

}  // namespace

double GroundTriangle::height(const GroundPoint& point) const {
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

/// Edges towards coarse neighbours stay straight, so that the surface has no cracks.
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

void Terrain::for_triangles_of_cell(int i, int j, const Visit& visit) const {
  const auto column = static_cast<std::size_t>(i);
  const auto row = static_cast<std::size_t>(j);
  using CornerHeights = std::array<std::array<double, 2>, 2>;  // [z][x]
  const auto emit = [&](const GroundPoint& low, const GroundPoint& high, const CornerHeights& h) {
    const GroundPoint p10(high.x(), low.y());
    const GroundPoint p01(low.x(), high.y());
    visit({{low, p10, high}, {h[0][0], h[0][1], h[1][1]}}, is_fine(i, j));
    visit({{low, high, p01}, {h[0][0], h[1][1], h[1][0]}}, is_fine(i, j));
  };
  const GroundPoint origin(xs_[column], zs_[row]);
  const GroundPoint size(xs_[column + 1] - xs_[column], zs_[row + 1] - zs_[row]);
  if (!is_fine(i, j)) {
    const std::size_t n = row * xs_.size() + column;
    emit(origin, origin + size,
         {{{heights_[n], heights_[n + 1]}, {heights_[n + xs_.size()], heights_[n + xs_.size() + 1]}}});
    return;
  }
  const FineHeights& h = *fine_[cell(i, j)];
  for (std::size_t b = 0; b < kSubdivisions; ++b) {
    for (std::size_t a = 0; a < kSubdivisions; ++a) {
      const auto at = [&](std::size_t da, std::size_t db) {
        return GroundPoint(origin.x() + size.x() * static_cast<double>(a + da) / kSubdivisions,
                           origin.y() + size.y() * static_cast<double>(b + db) / kSubdivisions);
      };
      emit(at(0, 0), at(1, 1), {{{h[b][a], h[b][a + 1]}, {h[b + 1][a], h[b + 1][a + 1]}}});
    }
  }
}

void Terrain::for_triangles_in(const GroundPoint& low, const GroundPoint& high, const Visit& visit) const {
  for (int j = locate(zs_, low.y()); j <= locate(zs_, high.y()); ++j) {
    for (int i = locate(xs_, low.x()); i <= locate(xs_, high.x()); ++i) for_triangles_of_cell(i, j, visit);
  }
}

void Terrain::for_each_triangle(const Visit& visit) const {
  for_triangles_in({xs_.front(), zs_.front()}, {xs_.back(), zs_.back()}, visit);
}

double Terrain::kerb(const GroundPoint& point) const {
  const bool on_road = route_->distance(point, profile_.road_half_width_m) < profile_.road_half_width_m;
  return on_road ? 0.0 : profile_.kerb_height_m;
}

double Terrain::height(const GroundPoint& point) const {
  double height = 0.0;
  double best = -std::numeric_limits<double>::max();  // the triangle that holds the point, or is nearest to
  for_triangles_in(point, point, [&](const GroundTriangle& triangle, bool) {
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

}  // namespace stereo_slam::simulator
