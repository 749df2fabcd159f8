// SPDX-License-Identifier: MIT
#include "simulator/rendering/projection.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Faces smaller than this in both directions hardly ever cover a sample, and are not drawn.
constexpr double kSmallest_px = 0.2;

/// Convex polygon, large enough for a clipped quadrilateral.
template <class Point>
struct Polygon {
  std::array<Point, ScreenFace::kMaxEdges> points;
  int count = 0;
  void add(const Point& point) { points[static_cast<std::size_t>(count++)] = point; }
  [[nodiscard]] const Point& operator[](int i) const { return points[static_cast<std::size_t>(i)]; }
};

/// Part of the polygon in front of the near plane (Sutherland and Hodgman 1974).
[[nodiscard]] Polygon<Vector3d> clip_near(const Polygon<Vector3d>& polygon) {
  Polygon<Vector3d> clipped;
  for (int i = 0; i < polygon.count; ++i) {
    const Vector3d& a = polygon[i];
    const Vector3d& b = polygon[(i + 1) % polygon.count];
    const bool a_inside = a.z() >= kNearPlane_m;
    const bool b_inside = b.z() >= kNearPlane_m;
    if (a_inside) clipped.add(a);
    if (a_inside != b_inside) clipped.add(a + (kNearPlane_m - a.z()) / (b.z() - a.z()) * (b - a));
  }
  return clipped;
}

/// Fills the bounding box; false when the polygon misses the image or is too small.
[[nodiscard]] bool set_bounds(ScreenFace& screen, const Polygon<Vector2d>& outline,
                              const PinholeCamera& camera) {
  Vector2d low = outline[0];
  Vector2d high = outline[0];
  for (int i = 1; i < outline.count; ++i) {
    low = low.cwiseMin(outline[i]);
    high = high.cwiseMax(outline[i]);
  }
  const double right = camera.width_px - 0.5;
  const double bottom = camera.height_px - 0.5;
  if (high.x() < -0.5 || high.y() < -0.5 || low.x() > right || low.y() > bottom) return false;
  if ((high - low).maxCoeff() < kSmallest_px) return false;
  const auto nearest = [](double x, int last) {
    return static_cast<int>(std::clamp(std::round(x), 0.0, static_cast<double>(last)));
  };
  screen.first_column = nearest(low.x(), camera.width_px - 1);
  screen.last_column = nearest(high.x(), camera.width_px - 1);
  screen.first_row = nearest(low.y(), camera.height_px - 1);
  screen.last_row = nearest(high.y(), camera.height_px - 1);
  return true;
}

/// Fills the edges, all turned inwards, whatever the orientation of the polygon.
void set_edges(ScreenFace& screen, const Polygon<Vector2d>& outline) {
  double twice_area = 0.0;
  for (int i = 1; i + 1 < outline.count; ++i) {
    const Vector2d a = outline[i] - outline[0];
    const Vector2d b = outline[i + 1] - outline[0];
    twice_area += a.x() * b.y() - a.y() * b.x();
  }
  const double turn = twice_area >= 0.0 ? 1.0 : -1.0;
  for (int i = 0; i < outline.count; ++i) {
    const Vector2d& a = outline[i];
    const Vector2d edge = outline[(i + 1) % outline.count] - a;
    const double length = edge.norm();
    if (length < 1e-9) continue;
    const Vector2d normal = turn / length * Vector2d(-edge.y(), edge.x());
    screen.edges[static_cast<std::size_t>(screen.edge_count++)] = {normal.x(), normal.y(), -normal.dot(a)};
  }
}

/// Coefficients of the affine function (x, y) -> a . ray(x, y).
[[nodiscard]] ImagePlane dot_with_ray(const Vector3d& a, const PinholeCamera& camera) {
  const double dx = a.x() / camera.fx;
  const double dy = a.y() / camera.fy;
  return {dx, dy, a.z() - dx * camera.cx - dy * camera.cy};
}

}  // namespace

PinholeCamera scaled(const PinholeCamera& camera, double scale) {
  return {.width_px = static_cast<int>(std::lround(camera.width_px * scale)),
          .height_px = static_cast<int>(std::lround(camera.height_px * scale)),
          .fx = camera.fx * scale,
          .fy = camera.fy * scale,
          .cx = (camera.cx + 0.5) * scale - 0.5,
          .cy = (camera.cy + 0.5) * scale - 0.5};
}

void validate(const PinholeCamera& camera) {
  if (camera.width_px > 0 && camera.height_px > 0 && camera.fx > 0.0 && camera.fy > 0.0) return;
  throw std::invalid_argument("the camera needs a positive size and focal length, not " +
                              std::to_string(camera.width_px) + " x " + std::to_string(camera.height_px) +
                              " px, " + std::to_string(camera.fx) + " and " + std::to_string(camera.fy));
}

AffineCoordinate view_coordinate(const Vector3d& axis, double offset, const Eigen::Isometry3d& T_camera_world,
                                 const PinholeCamera& camera) {
  const Vector3d axis_camera = T_camera_world.linear() * axis;
  return {dot_with_ray(axis_camera, camera), offset - axis_camera.dot(T_camera_world.translation())};
}

std::optional<ScreenFace> project_face(const Face& face, const Eigen::Isometry3d& T_camera_world,
                                       const PinholeCamera& camera, const std::vector<Material>& materials) {
  Polygon<Vector3d> polygon;
  bool in_front = false;
  bool crosses = false;
  for (int i = 0; i < face.corner_count; ++i) {
    polygon.add(T_camera_world * face.corners[static_cast<std::size_t>(i)].cast<double>());
    const bool corner_in_front = polygon[i].z() >= kNearPlane_m;
    in_front |= corner_in_front;
    crosses |= !corner_in_front;
  }
  if (!in_front) return std::nullopt;

  const Material& material = materials[face.material];
  const Vector3d normal = (polygon[1] - polygon[0]).cross(polygon[2] - polygon[0]);
  const double plane = normal.dot(polygon[0]);
  if (material.two_sided ? plane == 0.0 : plane >= 0.0) return std::nullopt;

  if (crosses) polygon = clip_near(polygon);
  Polygon<Vector2d> outline;
  for (int i = 0; i < polygon.count; ++i) {
    const Vector3d& p = polygon[i];
    outline.add({camera.fx * p.x() / p.z() + camera.cx, camera.fy * p.y() / p.z() + camera.cy});
  }
  ScreenFace screen;
  if (!set_bounds(screen, outline, camera)) return std::nullopt;
  set_edges(screen, outline);
  screen.inverse_depth = dot_with_ray(normal / plane, camera);
  const auto texture_plane = [&](const Eigen::Vector3f& axis, float offset) {
    return view_coordinate(axis.cast<double>(), static_cast<double>(offset), T_camera_world, camera)
        .over_depth(screen.inverse_depth);
  };
  screen.u_over_depth = texture_plane(face.u_axis, face.u_offset);
  screen.v_over_depth = texture_plane(face.v_axis, face.v_offset);
  screen.brightness = face.brightness;
  screen.sample_order = std::bit_cast<std::uint32_t>(face.corners[0].x()) >> 4;
  screen.material = &material;
  return screen;
}

bool may_be_visible(const Eigen::AlignedBox3f& box, const Eigen::Isometry3d& T_camera_world,
                    const PinholeCamera& camera) {
  const Vector3d centre = T_camera_world * box.center().cast<double>();
  const Vector3d half = 0.5 * (T_camera_world.linear().cwiseAbs() * box.sizes().cast<double>());
  // Outward normals of the planes through the optical centre and the image borders.
  const double left = (camera.cx + 0.5) / camera.fx;
  const double right = (camera.width_px - 0.5 - camera.cx) / camera.fx;
  const double top = (camera.cy + 0.5) / camera.fy;
  const double bottom = (camera.height_px - 0.5 - camera.cy) / camera.fy;
  const std::array<Vector3d, 5> outward = {Vector3d(-1.0, 0.0, -left), Vector3d(1.0, 0.0, -right),
                                           Vector3d(0.0, -1.0, -top), Vector3d(0.0, 1.0, -bottom),
                                           Vector3d(0.0, 0.0, -1.0)};
  return std::all_of(outward.begin(), outward.end(), [&](const Vector3d& normal) {
    return normal.dot(centre) - normal.cwiseAbs().dot(half) <= 0.0;
  });
}

}  // namespace stereo_slam::simulator
