// SPDX-License-Identifier: MIT
#include "simulator/world/props.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

constexpr double kFoot_m = -0.3;  ///< objects reach a little into the ground

[[nodiscard]] Vector3d random_direction(Random& random) {
  const double z = random.uniform(-1.0, 1.0);
  const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle), z, r * std::sin(angle)};
}

/// Ellipsoid of leafy branches.
struct Crown {
  Vector3d centre;
  Vector3d radii_m;
  int branches;
  double branch_m;  ///< mean length
};

/// Adds a crown. Its leaves are darker inside and below.
void add_crown(Mesh& mesh, Random& random, const Palette& palette, const Crown& crown) {
  const MaterialId leaves = random.pick(palette.foliage);
  const double species = random.uniform(0.7, 1.15);
  for (int i = 0; i < crown.branches; ++i) {
    const double depth = std::cbrt(random.uniform(0.1, 1.0));
    const Vector3d offset = depth * random_direction(random);
    const Vector3d normal = (offset.normalized() + 0.9 * random_direction(random)).normalized();
    const Vector3d a = crown.branch_m * random.uniform(0.7, 1.3) * normal.unitOrthogonal();
    const Vector3d b = a.norm() * normal.cross(a).normalized();
    const double light = 0.45 + 0.35 * depth + 0.25 * offset.y();
    const Vector3d corner = crown.centre + offset.cwiseProduct(crown.radii_m) - 0.5 * (a + b);
    mesh.rectangle(corner, a, b, {leaves, species * light, true, 0.0, 0.0});
  }
}

}  // namespace

void add_board(Mesh& mesh, const Board& board) {
  const Vector3d x = Vector3d::UnitX() * board.size_m.x();
  const Vector3d y = Vector3d::UnitY() * board.size_m.y();
  mesh.rectangle(board.corner, x, y, board.image);
  mesh.rectangle(board.corner + x, -x, y, board.back);
}

void add_tree(Mesh& mesh, Random& random, const Palette& palette, double height_m, TreeDetail detail) {
  const Paint bark = varied_paint(random, palette.bark, 0.4, 0.75);
  const double trunk = height_m * random.uniform(0.3, 0.4);
  const double girth = 0.022 * height_m;
  mesh.column({{0.0, kFoot_m, 0.0}, trunk - kFoot_m, girth * 1.25, girth * 0.8, 7}, bark);
  const double radius = height_m * random.uniform(0.22, 0.32);
  for (int i = 0; i < 4; ++i) {  // boughs: slanted boards seen from both of their sides
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
    const Vector3d out(std::cos(angle), 0.0, std::sin(angle));
    const Vector3d bough = 0.7 * radius * out + Vector3d::UnitY() * (0.66 * height_m - trunk);
    const Vector3d thick = 0.9 * girth * Vector3d(-out.z(), 0.0, out.x());
    const Vector3d foot = Vector3d::UnitY() * (trunk - 0.1) - 0.5 * thick;
    mesh.rectangle(foot, thick, bough, bark);
    mesh.rectangle(foot + thick, -thick, bough, bark);
  }
  const Vector3d radii(radius, random.uniform(0.28, 0.38) * height_m, radius);
  const bool near = detail == TreeDetail::kNear;
  add_crown(mesh, random, palette,
            {{0.0, 0.66 * height_m, 0.0}, radii, near ? 46 : 18, (near ? 0.26 : 0.4) * height_m});
}

void add_bush(Mesh& mesh, Random& random, const Palette& palette, double height_m) {
  add_crown(
      mesh, random, palette,
      {{0.0, 0.45 * height_m, 0.0}, {0.5 * height_m, 0.45 * height_m, 0.5 * height_m}, 12, 0.7 * height_m});
}

void add_boundary(Mesh& mesh, Random& random, const Palette& palette, double length_m) {
  const double u = random.uniform(0.0, 64.0);
  const double v = random.uniform(0.0, 64.0);
  const double half = 0.5 * length_m;
  switch (random.integer(0, 2)) {
    case 0: {
      const Paint hedge{palette.hedge, random.uniform(0.55, 0.8), false, u, v};
      mesh.box({-half, kFoot_m, -0.7}, {half, random.uniform(0.9, 1.8), 0.0}, hedge);
      break;
    }
    case 1: {
      const Paint wall{random.pick(palette.walls), random.uniform(0.7, 1.3), false, u, v};
      mesh.box({-half, kFoot_m, -0.25}, {half, random.uniform(0.6, 1.5), 0.0}, wall);
      break;
    }
    default:
      mesh.rectangle({-half, 0.0, 0.0}, Vector3d::UnitX() * length_m, Vector3d::UnitY() * 1.28,
                     {palette.fence, random.uniform(0.5, 1.5), false, u, 0.0});
      for (double x = -half; x <= half; x += 2.5) {
        mesh.box({x, kFoot_m, -0.12}, {x + 0.12, 1.35, 0.0},
                 {palette.metal, random.uniform(0.5, 1.3), false, u, v});
      }
  }
}

void add_lamp(Mesh& mesh, Random& random, const Palette& palette) {
  const Paint metal = varied_paint(random, palette.metal, 0.6, 1.1);
  const double height = random.uniform(5.5, 7.5);
  mesh.column({{0.0, kFoot_m, 0.0}, 1.2 - kFoot_m, 0.11, 0.1, 8}, metal);
  mesh.column({{0.0, 1.2, 0.0}, height - 1.2, 0.075, 0.05, 8}, metal);
  mesh.box({-0.04, height - 0.1, 0.0}, {0.04, height, 1.6}, metal);
  mesh.box({-0.15, height - 0.16, 1.2}, {0.15, height + 0.06, 2.0}, metal);
}

void add_sign(Mesh& mesh, Random& random, const Palette& palette) {
  const Paint metal = varied_paint(random, palette.metal, 0.7, 1.2);
  const double side = random.uniform(0.5, 0.9);
  const double top = random.uniform(2.3, 3.2);
  mesh.column({{0.0, kFoot_m, 0.0}, top - kFoot_m, 0.04, 0.04, 6}, metal);
  for (int i = random.integer(1, 2); i > 0; --i) {
    const Vector3d corner(-0.5 * side, top - i * (side + 0.05), 0.06);
    add_board(mesh, {corner, {side, side}, {random.pick(palette.signs), 1.25, true}, metal});
  }
}

void add_box(Mesh& mesh, Random& random, const Palette& palette) {
  const double w = random.uniform(0.15, 0.9);
  const double h = random.uniform(0.7, 1.5);
  const double d = random.uniform(0.15, 0.5);
  const Paint body = varied_paint(random, palette.metal, 0.4, 1.4);
  mesh.box({-0.5 * w, kFoot_m, -0.5 * d}, {0.5 * w, h, 0.5 * d}, body);
  const Vector3d corner(-0.4 * w, 0.35 * h, 0.5 * d + 0.01);
  mesh.rectangle(corner, Vector3d::UnitX() * 0.8 * w, Vector3d::UnitY() * 0.5 * h,
                 {random.pick(palette.signs), 0.9, true});
}

}  // namespace stereo_slam::simulator
