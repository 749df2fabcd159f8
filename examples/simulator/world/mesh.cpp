// SPDX-License-Identifier: MIT
#include "simulator/world/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulator/world/shadows.hpp"

namespace stereo_slam::simulator {

using Eigen::Vector3d;

double daylight(const Vector3d& normal) {
  const double sky = 0.5 - 0.5 * normal.y();  // y points down
  return 0.36 + 0.2 * sky + 1.0 * std::max(0.0, normal.dot(direction_to_sun()));
}

Paint varied_paint(Random& random, MaterialId material, double low, double high) {
  return {material, random.uniform(low, high), false, random.uniform(0.0, 64.0), random.uniform(0.0, 64.0)};
}

Eigen::Isometry3d stand(const GroundPoint& position, const GroundPoint& front, double ground_y) {
  Eigen::Isometry3d T_world_object = Eigen::Isometry3d::Identity();
  T_world_object.linear().col(0) = Vector3d(-front.y(), 0.0, front.x());
  T_world_object.linear().col(1) = -Vector3d::UnitY();
  T_world_object.linear().col(2) = Vector3d(front.x(), 0.0, front.y());
  T_world_object.translation() = Vector3d(position.x(), ground_y, position.y());
  return T_world_object;
}

void Mesh::polygon(const std::vector<Vector3>& corners, const Vector3& a, const Vector3& b,
                   const Paint& paint) {
  const double period_m = (*materials_)[paint.material].period_m;
  const Vector3 u = paint.stretched ? Vector3(a / a.squaredNorm()) : Vector3(a.normalized() / period_m);
  const Vector3 v = paint.stretched ? Vector3(-b / b.squaredNorm()) : Vector3(-b.normalized() / period_m);
  const Vector3 u_world = T_world_object_.linear() * u;
  const Vector3 v_world = T_world_object_.linear() * v;
  const Vector3 origin = T_world_object_ * corners.front();
  const Vector3 normal = (T_world_object_.linear() * a.cross(b)).normalized();

  Face style;
  style.material = paint.material;
  style.brightness = static_cast<float>(paint.brightness * daylight(normal));
  style.u_axis = u_world.cast<float>();
  style.v_axis = v_world.cast<float>();
  // Images begin at the first corner; textures in metres continue from one part of an object to the next.
  const Vector3 zero = paint.stretched ? origin : T_world_object_.translation();
  style.u_offset = static_cast<float>(paint.u0 - style.u_axis.cast<double>().dot(zero));
  style.v_offset = static_cast<float>(paint.v0 - style.v_axis.cast<double>().dot(zero));
  for (std::size_t i = 1; i + 1 < corners.size(); i += 2) {
    Face face = style;
    face.corner_count = i + 2 < corners.size() ? 4 : 3;
    face.corners[0] = origin.cast<float>();
    for (std::size_t k = 1; k < static_cast<std::size_t>(face.corner_count); ++k) {
      face.corners[k] = (T_world_object_ * corners[i + k - 1]).cast<float>();
    }
    faces_->push_back(face);
  }
}

void Mesh::rectangle(const Vector3& p, const Vector3& a, const Vector3& b, const Paint& paint) {
  polygon({p, p + a, p + a + b, p + b}, a, b, paint);
}

void Mesh::centred_rectangle(const Vector3& centre, const Vector3& a, const Vector3& b, const Paint& paint) {
  rectangle(centre - 0.5 * a - 0.5 * b, a, b, paint);
}

void Mesh::disc(const Vector3& centre, double radius_m, double side, const Paint& paint) {
  constexpr int kCorners = 12;
  const Vector3 along = -side * Vector3::UnitZ();
  const Vector3 up = Vector3::UnitY();
  std::vector<Vector3> corners;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kCorners;
    corners.emplace_back(centre + radius_m * (std::cos(angle) * along + std::sin(angle) * up));
  }
  Paint look = paint;
  if (paint.stretched) look.v0 += 0.5;  // the first corner is half way up the right border of the image
  polygon(corners, 2.0 * radius_m * along, 2.0 * radius_m * up, look);
}

void Mesh::box(const Vector3& low, const Vector3& high, const Paint& paint) {
  const Vector3 x(high.x() - low.x(), 0.0, 0.0);
  const Vector3 y(0.0, high.y() - low.y(), 0.0);
  const Vector3 z(0.0, 0.0, high.z() - low.z());
  rectangle(low + z, x, y, paint);       // front
  rectangle(low + x, -x, y, paint);      // back
  rectangle(low + x + z, -z, y, paint);  // right
  rectangle(low, z, y, paint);           // left
  rectangle(low + y + z, x, -z, paint);  // top
}

void Mesh::column(const Column& column, const Paint& paint) {
  const auto around = [&](int i, double radius, double y) {
    const double angle = 2.0 * std::numbers::pi * i / column.sides;
    return Vector3(column.foot + Vector3(radius * std::cos(angle), y, -radius * std::sin(angle)));
  };
  for (int i = 0; i < column.sides; ++i) {
    const Vector3 a = around(i, column.bottom_radius_m, 0.0);
    const Vector3 b = around(i + 1, column.bottom_radius_m, 0.0);
    const Vector3 c = around(i + 1, column.top_radius_m, column.height_m);
    const Vector3 d = around(i, column.top_radius_m, column.height_m);
    Paint side = paint;
    side.u0 += i * (b - a).norm() / (*materials_)[paint.material].period_m;
    polygon({a, b, c, d}, b - a, Vector3::UnitY() * column.height_m, side);
  }
}

}  // namespace stereo_slam::simulator
