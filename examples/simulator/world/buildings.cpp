// SPDX-License-Identifier: MIT
#include "simulator/world/buildings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

constexpr double kFoundation_m = 1.5;  ///< below the ground, where that falls away

/// What all walls of a house have in common.
struct Style {
  Paint wall;
  Paint trim;  ///< sills, frames of openings
  Paint plinth;
  Paint shutter;
  double floor_height_m = 2.9;
  double window_width_m = 1.2;
  double window_height_m = 1.4;
  double sill_height_m = 0.9;
  double axis_m = 2.6;  ///< from window to window
  double recess_m = 0.16;
  bool has_shutters = false;
  bool has_balconies = false;
  std::vector<MaterialId> windows;
};

[[nodiscard]] Style make_style(Random& random, const Palette& palette) {
  Style style;
  const auto shift = [&] { return random.uniform(0.0, 64.0); };
  style.wall = {random.pick(palette.walls), random.uniform(0.6, 1.9), false, shift(), shift()};
  style.trim = {palette.metal, random.uniform(0.7, 1.7), false, shift(), shift()};
  style.plinth = {random.pick(palette.walls), random.uniform(0.5, 0.9), false, shift(), shift()};
  style.shutter = {palette.fence, random.uniform(0.3, 1.1), false, shift(), shift()};
  style.shutter.material = palette.walls.back();
  style.floor_height_m = random.uniform(2.7, 3.3);
  style.window_width_m = random.uniform(0.9, 1.7);
  style.window_height_m = random.uniform(1.1, 1.7);
  style.sill_height_m = random.uniform(0.75, 1.05);
  style.axis_m = style.window_width_m + random.uniform(0.9, 1.8);
  style.recess_m = random.uniform(0.08, 0.22);
  style.has_shutters = random.chance(0.35);
  style.has_balconies = random.chance(0.3);
  for (int i = 0; i < 4; ++i) style.windows.push_back(random.pick(palette.windows));
  return style;
}

/// Opening in the plane z = 0 with its lower left corner at `corner`: reveals, window, sill, shutters.
void add_window(Mesh& mesh, Random& random, const Style& style, const Vector3d& corner) {
  const Vector3d w = Vector3d::UnitX() * style.window_width_m;
  const Vector3d h = Vector3d::UnitY() * style.window_height_m;
  const Vector3d in = -Vector3d::UnitZ() * style.recess_m;
  mesh.rectangle(corner + in, w, h, {random.pick(style.windows), random.uniform(0.75, 1.1), true});
  mesh.rectangle(corner, in, h, style.trim);
  mesh.rectangle(corner + w + in, -in, h, style.trim);
  mesh.rectangle(corner + h + in, w, -in, style.trim);
  mesh.rectangle(corner, w, in, style.trim);
  mesh.box(corner + Vector3d(-0.08, -0.08, 0.0), corner + w + Vector3d(0.08, 0.0, 0.12), style.trim);
  if (!style.has_shutters) return;
  const Vector3d half = 0.5 * w;
  const Vector3d forward(0.0, 0.0, 0.05);
  mesh.rectangle(corner + forward - half, half, h, style.shutter);
  mesh.rectangle(corner + forward + w, half, h, style.shutter);
}

void add_balcony(Mesh& mesh, const Style& style, const Vector3d& corner) {
  const double width = style.window_width_m + 0.8;
  const Vector3d low = corner + Vector3d(-0.4, -style.sill_height_m, 0.0);
  mesh.box(low, low + Vector3d(width, 0.15, 1.1), style.trim);
  mesh.rectangle(low + Vector3d(0.0, 0.15, 1.05), Vector3d::UnitX() * width, Vector3d::UnitY() * 0.9,
                 style.plinth);
  mesh.rectangle(low + Vector3d(width, 0.15, 1.05), -Vector3d::UnitZ(), Vector3d::UnitY() * 0.9,
                 style.plinth);
  mesh.rectangle(low + Vector3d(0.0, 0.15, 0.05), Vector3d::UnitZ(), Vector3d::UnitY() * 0.9, style.plinth);
}

/// Shop window or door in front of a wall from x0 on; returns how wide it is.
double add_entrance(Mesh& mesh, Random& random, const Palette& palette, double x0, double width_m,
                    bool is_shop) {
  const double height = is_shop ? 2.6 : 2.15;
  const Vector3d w = Vector3d::UnitX() * width_m;
  const Vector3d h = Vector3d::UnitY() * height;
  const Vector3d corner(x0, 0.0, 0.06);
  const Paint frame{palette.metal, random.uniform(0.5, 1.4), false, random.uniform(), random.uniform()};
  mesh.box({x0, -kFoundation_m, 0.0}, {x0 + width_m, height, 0.05}, frame);
  mesh.rectangle(corner, w, h,
                 {random.pick(is_shop ? palette.shops : palette.doors), random.uniform(0.8, 1.2), true});
  if (random.chance(0.5)) {  // canopy
    mesh.box({x0 - 0.2, height + 0.1, 0.0}, {x0 + width_m + 0.2, height + 0.22, random.uniform(0.5, 1.2)},
             frame);
  }
  return width_m;
}

/// Wall in the plane z = 0 from x = 0 to `width_m`, with rows of windows; the front has a door or a shop.
void add_facade(Mesh& mesh, Random& random, const Palette& palette, const Style& style, double width_m,
                int floors, bool is_front) {
  const int axes = std::max(0, static_cast<int>((width_m - 0.8) / style.axis_m));
  const double margin = 0.5 * (width_m - axes * style.axis_m) + 0.5 * (style.axis_m - style.window_width_m);
  const double top = floors * style.floor_height_m;
  const bool has_shop = is_front && random.chance(0.3);
  const auto door_axis = axes > 0 ? random.integer(0, axes - 1) : 0;
  const auto wall = [&](double x0, double x1, double y0, double y1) {
    mesh.rectangle({x0, y0, 0.0}, Vector3d::UnitX() * (x1 - x0), Vector3d::UnitY() * (y1 - y0), style.wall);
  };

  double built = -kFoundation_m;
  for (int floor = 0; floor < floors && axes > 0; ++floor) {
    const double sill = floor * style.floor_height_m + style.sill_height_m;
    const double lintel = sill + style.window_height_m;
    wall(0.0, width_m, built, sill);
    double x = 0.0;
    for (int axis = 0; axis < axes; ++axis) {
      const bool is_open =
          !(is_front && floor == 0 && (has_shop || axis == door_axis)) && random.chance(0.93);
      if (!is_open) continue;
      const Vector3d corner(margin + axis * style.axis_m, sill, 0.0);
      wall(x, corner.x(), sill, lintel);
      add_window(mesh, random, style, corner);
      if (is_front && floor > 0 && style.has_balconies && axis % 2 == 0) add_balcony(mesh, style, corner);
      x = corner.x() + style.window_width_m;
    }
    wall(x, width_m, sill, lintel);
    built = lintel;
  }
  wall(0.0, width_m, built, top);
  if (!is_front) return;

  if (has_shop) {
    for (double x = 0.4; x + 3.0 < width_m;) x += 0.3 + add_entrance(mesh, random, palette, x, 3.0, true);
  } else if (axes > 0) {
    add_entrance(mesh, random, palette, margin + door_axis * style.axis_m, 1.05, false);
  }
  const double pipe = random.uniform(0.15, 0.3);  // drainpipe, sign, number
  mesh.box({width_m - pipe - 0.1, -kFoundation_m, 0.0}, {width_m - pipe, top, 0.1}, style.trim);
  if (random.chance(0.6)) {
    const double side = random.uniform(0.5, 1.1);
    const double x = random.uniform(0.2, std::max(0.3, width_m - side - 0.5));
    mesh.box({x, style.floor_height_m - 0.5, 0.0}, {x + side, style.floor_height_m - 0.5 + side, 0.1},
             style.trim);
    mesh.rectangle({x, style.floor_height_m - 0.5, 0.11}, Vector3d::UnitX() * side, Vector3d::UnitY() * side,
                   {random.pick(palette.signs), 1.1, true});
  }
  mesh.box({0.0, -kFoundation_m, 0.0}, {width_m, 0.35, 0.04}, style.plinth);
}

/// Saddle roof over a body whose front left foot is the origin; the ridge runs along x.
void add_saddle_roof(Mesh& mesh, Random& random, const Palette& palette, const Style& style,
                     const BuildingSize& size, double eaves) {
  const double w = size.width_m;
  const double d = size.depth_m;
  const double rise = 0.5 * d * std::tan(random.uniform(0.45, 0.85));
  const double overhang = random.uniform(0.3, 0.6);
  const double drop = overhang * rise / (0.5 * d);
  const Paint tiles{random.pick(palette.roofs), random.uniform(0.55, 1.1), false, random.uniform(0.0, 64.0),
                    random.uniform(0.0, 64.0)};
  const Vector3d along = Vector3d::UnitX() * (w + 2.0 * overhang);
  const Vector3d front(-overhang, eaves - drop, overhang);
  const Vector3d back(w + overhang, eaves - drop, -d - overhang);
  const Vector3d up_front(0.0, rise + drop, -(0.5 * d + overhang));
  const Vector3d up_back(0.0, rise + drop, 0.5 * d + overhang);
  mesh.rectangle(front, along, up_front, tiles);
  mesh.rectangle(back, -along, up_back, tiles);
  mesh.rectangle(front + up_front, along, -up_front, style.trim);  // undersides
  mesh.rectangle(back + up_back, -along, -up_back, style.trim);
  const Vector3d ridge_left(0.0, eaves + rise, -0.5 * d);
  const Vector3d ridge_right(w, eaves + rise, -0.5 * d);
  const Vector3d height = Vector3d::UnitY() * rise;
  mesh.polygon({{0.0, eaves, -d}, {0.0, eaves, 0.0}, ridge_left}, Vector3d::UnitZ() * d, height, style.wall);
  mesh.polygon({{w, eaves, 0.0}, {w, eaves, -d}, ridge_right}, -Vector3d::UnitZ() * d, height, style.wall);
  for (int i = random.integer(1, 3); i > 0; --i) {  // chimneys
    const double x = random.uniform(0.1, 0.85) * w;
    mesh.box({x, eaves, -0.45 * d}, {x + 0.6, eaves + rise + random.uniform(0.4, 1.1), -0.45 * d + 0.6},
             style.plinth);
  }
  for (int i = random.integer(0, 3); i > 0; --i) {  // skylights, lying on the front slope
    const Vector3d corner =
        front + 0.3 * up_front + along * random.uniform(0.1, 0.8) + Vector3d(0.0, 0.05, 0.05);
    mesh.rectangle(corner, Vector3d::UnitX(), up_front.normalized() * 1.2,
                   {palette.windows.front(), 1.0, true});
  }
}

/// Flat roof behind a parapet, with boxes and masts on it.
void add_flat_roof(Mesh& mesh, Random& random, const Palette& palette, const Style& style,
                   const BuildingSize& size, double eaves) {
  const double w = size.width_m;
  const double d = size.depth_m;
  mesh.box({-0.15, eaves, -d - 0.15}, {w + 0.15, eaves + random.uniform(0.3, 0.8), 0.15}, style.trim);
  for (int i = random.integer(1, 3); i > 0; --i) {
    const double x = random.uniform(0.1, 0.7) * w;
    mesh.box({x, eaves, -0.7 * d}, {x + random.uniform(1.0, 2.5), eaves + random.uniform(1.0, 2.2), -0.3 * d},
             style.plinth);
  }
  mesh.column({random.uniform(0.2, 0.8) * w, eaves, -0.5 * d}, random.uniform(2.0, 4.0), 0.06, 0.03, 4,
              {palette.metal, 0.6});
}

}  // namespace

void add_building(Mesh& mesh, Random& random, const Palette& palette, const BuildingSize& size) {
  const Style style = make_style(random, palette);
  const Eigen::Isometry3d T_world_front =
      mesh.placement() * Eigen::Translation3d(-0.5 * size.width_m, 0.0, 0.0);
  const auto side = [&](double x, double z, double quarter_turns) {
    return T_world_front * Eigen::Translation3d(x, 0.0, z) *
           Eigen::AngleAxisd(0.5 * std::numbers::pi * quarter_turns, Vector3d::UnitY());
  };
  const double w = size.width_m;
  const double d = size.depth_m;
  mesh.place(T_world_front);
  add_facade(mesh, random, palette, style, w, size.floors, true);
  mesh.place(side(w, 0.0, 1.0));
  add_facade(mesh, random, palette, style, d, size.floors, false);
  mesh.place(side(w, -d, 2.0));
  add_facade(mesh, random, palette, style, w, size.floors, false);
  mesh.place(side(0.0, -d, 3.0));
  add_facade(mesh, random, palette, style, d, size.floors, false);

  mesh.place(T_world_front);
  const double eaves = size.floors * style.floor_height_m;
  const bool saddle = size.floors <= 3 && random.chance(0.75);
  (saddle ? add_saddle_roof : add_flat_roof)(mesh, random, palette, style, size, eaves);
}

}  // namespace stereo_slam::simulator
