// SPDX-License-Identifier: MIT
#include "simulator/world/highway_furniture.hpp"

#include "simulator/world/props.hpp"

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

constexpr double kPostFoot_m = -0.4;  ///< objects reach a little into the ground

}  // namespace

void add_guard_rail(Mesh& mesh, Random& random, const Palette& palette, double length_m, double rise_m) {
  constexpr double kBottom_m = 0.45;
  constexpr double kHeight_m = 0.31;
  constexpr double kThickness_m = 0.08;
  constexpr double kPostSpacing_m = 2.0;
  const Paint metal = varied_paint(random, palette.metal, 0.95, 1.1);
  const Vector3d along(length_m, rise_m, 0.0);
  const Vector3d up(0.0, kHeight_m, 0.0);
  const Vector3d back(0.0, 0.0, -kThickness_m);
  const Vector3d corner(-0.5 * length_m, kBottom_m - 0.5 * rise_m, 0.0);
  mesh.rectangle(corner, along, up, metal);
  mesh.rectangle(corner + along + back, -along, up, metal);
  mesh.rectangle(corner + up, along, back, metal);
  for (double x = 0.5 * kPostSpacing_m; x < length_m; x += kPostSpacing_m) {
    const double ground = (x / length_m - 0.5) * rise_m;
    mesh.box({x - 0.5 * length_m - 0.05, ground + kPostFoot_m, -0.2},
             {x - 0.5 * length_m + 0.05, ground + kBottom_m + 0.25, -0.09}, metal);
  }
}

void add_delineator(Mesh& mesh, const Palette& palette) {
  constexpr double kHalf_m = 0.06;
  mesh.box({-kHalf_m, kPostFoot_m, -kHalf_m}, {kHalf_m, 0.72, kHalf_m}, {palette.metal, 1.4});
  mesh.box({-kHalf_m, 0.72, -kHalf_m}, {kHalf_m, 0.92, kHalf_m}, {palette.metal, 0.25});
  mesh.box({-kHalf_m, 0.92, -kHalf_m}, {kHalf_m, 1.05, kHalf_m}, {palette.metal, 1.4});
}

void add_direction_board(Mesh& mesh, Random& random, const Palette& palette) {
  const Paint metal = varied_paint(random, palette.metal, 0.7, 1.1);
  const double width = random.uniform(1.6, 3.0);
  const double height = random.uniform(1.2, 2.2);
  const double bottom = random.uniform(1.4, 2.0);
  for (const double x : {-0.35 * width, 0.35 * width})
    mesh.column({{x, kPostFoot_m, 0.0}, bottom + height - kPostFoot_m, 0.06, 0.06, 6}, metal);
  add_board(mesh,
            {{-0.5 * width, bottom, 0.08}, {width, height}, {random.pick(palette.signs), 1.25, true}, metal});
}

void add_gantry(Mesh& mesh, Random& random, const Palette& palette, double half_span_m) {
  constexpr double kBeam_m = 5.8;  ///< height above the road
  const Paint metal = varied_paint(random, palette.metal, 0.7, 1.1);
  for (const double x : {-half_span_m, half_span_m})
    mesh.box({x - 0.2, kPostFoot_m, -0.2}, {x + 0.2, kBeam_m, 0.2}, metal);
  mesh.box({-half_span_m - 0.2, kBeam_m, -0.25}, {half_span_m + 0.2, kBeam_m + 0.5, 0.25}, metal);
  mesh.rectangle({-half_span_m, kBeam_m, -0.25}, 2.0 * half_span_m * Vector3d::UnitX(),
                 0.5 * Vector3d::UnitZ(), metal);  // from below
  for (int board = 0; board < 3; ++board) {
    const double width = random.uniform(2.6, 4.2);
    const double centre = (board - 1) * 0.6 * half_span_m;
    const double height = random.uniform(1.6, 2.4);
    add_board(mesh, {{centre - 0.5 * width, kBeam_m - 0.3, 0.3},
                     {width, height},
                     {random.pick(palette.signs), 1.25, true},
                     metal});
  }
}

}  // namespace stereo_slam::simulator
