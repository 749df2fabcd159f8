// SPDX-License-Identifier: MIT
#include "simulator/world/buildings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFoundation_m = 1.5;  ///< depth of the walls below the ground, which may slope

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
  double axis_m = 2.6;  ///< distance of neighbouring windows
  double recess_m = 0.16;
  bool has_shutters = false;
  bool has_balconies = false;
  std::vector<MaterialId> windows;
};

[[nodiscard]] Style make_style(Random& random, const Palette& palette) {
  Style style;
  style.wall = varied_paint(random, random.pick(palette.walls), 0.6, 1.9);
  style.trim = varied_paint(random, palette.metal, 0.7, 1.7);
  style.plinth = varied_paint(random, random.pick(palette.walls), 0.5, 0.9);
  style.shutter = varied_paint(random, palette.walls.back(), 0.3, 1.1);
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

/// Builds a house of random style, part by part.
class HouseBuilder {
 public:
  HouseBuilder(Mesh& mesh, Random& random, const Palette& palette, const BuildingSize& size)
      : mesh_(mesh), random_(random), palette_(palette), size_(size), style_(make_style(random, palette)) {}

  void build() {
    const Eigen::Isometry3d T_world_front =
        mesh_.placement() * Eigen::Translation3d(-0.5 * size_.width_m, 0.0, 0.0);
    const auto side = [&](double x, double z, double quarter_turns) {
      return T_world_front * Eigen::Translation3d(x, 0.0, z) *
             Eigen::AngleAxisd(0.5 * std::numbers::pi * quarter_turns, Vector3d::UnitY());
    };
    const double w = size_.width_m;
    const double d = size_.depth_m;
    mesh_.place(T_world_front);
    front();
    mesh_.place(side(w, 0.0, 1.0));
    plain_wall(d);
    mesh_.place(side(w, -d, 2.0));
    plain_wall(w);
    mesh_.place(side(0.0, -d, 3.0));
    plain_wall(d);

    mesh_.place(T_world_front);
    if (size_.floors <= 3 && random_.chance(0.75)) {
      saddle_roof();
    } else {
      flat_roof();
    }
  }

 private:
  /// How the windows of a wall are spaced.
  struct Bays {
    double width_m;
    int count;
    double margin_m;  ///< from the corner to the first window
  };

  /// What the ground floor of the front has instead of windows.
  struct GroundFloor {
    bool is_front = false;
    bool has_shop = false;
    int door_bay = 0;

    [[nodiscard]] bool takes(int bay) const { return is_front && (has_shop || bay == door_bay); }
  };

  [[nodiscard]] double eaves_m() const { return size_.floors * style_.floor_height_m; }

  [[nodiscard]] Bays bays(double width_m) const {
    const int count = std::max(0, static_cast<int>((width_m - 0.8) / style_.axis_m));
    const double margin_m =
        0.5 * (width_m - count * style_.axis_m) + 0.5 * (style_.axis_m - style_.window_width_m);
    return {width_m, count, margin_m};
  }

  /// Only the front has a door or a shop. The bay of the door is drawn at random for every wall.
  [[nodiscard]] GroundFloor ground_floor(const Bays& bays, bool is_front) {
    const bool has_shop = is_front && random_.chance(0.3);
    const int door_bay = bays.count > 0 ? random_.integer(0, bays.count - 1) : 0;
    return {is_front, has_shop, door_bay};
  }

  void plain_wall(double width_m) {
    const Bays spacing = bays(width_m);
    wall(spacing, ground_floor(spacing, false));
  }

  /// The wall with a door or a shop, a drainpipe and perhaps a sign.
  void front() {
    const Bays spacing = bays(size_.width_m);
    const GroundFloor ground = ground_floor(spacing, true);
    wall(spacing, ground);
    if (ground.has_shop) {
      for (double x = 0.4; x + 3.0 < size_.width_m; x += 3.3) entrance(x, 3.0, true);
    } else if (spacing.count > 0) {
      entrance(spacing.margin_m + ground.door_bay * style_.axis_m, 1.05, false);
    }
    const double pipe = random_.uniform(0.15, 0.3);
    mesh_.box({size_.width_m - pipe - 0.1, -kFoundation_m, 0.0}, {size_.width_m - pipe, eaves_m(), 0.1},
              style_.trim);
    if (random_.chance(0.6)) sign();
    mesh_.box({0.0, -kFoundation_m, 0.0}, {size_.width_m, 0.35, 0.04}, style_.plinth);
  }

  /// Wall in the plane z = 0 from x = 0 to the width of `bays`, with rows of windows.
  void wall(const Bays& bays, const GroundFloor& ground) {
    double built = -kFoundation_m;
    for (int floor = 0; floor < size_.floors && bays.count > 0; ++floor) {
      const double sill = floor * style_.floor_height_m + style_.sill_height_m;
      const double lintel = sill + style_.window_height_m;
      masonry({0.0, built}, {bays.width_m, sill});
      double x = 0.0;
      for (int bay = 0; bay < bays.count; ++bay) {
        const bool has_window = !(floor == 0 && ground.takes(bay)) && random_.chance(0.93);
        if (!has_window) continue;
        const Vector3d corner(bays.margin_m + bay * style_.axis_m, sill, 0.0);
        masonry({x, sill}, {corner.x(), lintel});
        window(corner);
        if (ground.is_front && floor > 0 && style_.has_balconies && bay % 2 == 0) balcony(corner);
        x = corner.x() + style_.window_width_m;
      }
      masonry({x, sill}, {bays.width_m, lintel});
      built = lintel;
    }
    masonry({0.0, built}, {bays.width_m, eaves_m()});
  }

  /// Part of a wall between two corners (x, y).
  void masonry(const Vector2d& low, const Vector2d& high) {
    mesh_.rectangle({low.x(), low.y(), 0.0}, Vector3d::UnitX() * (high.x() - low.x()),
                    Vector3d::UnitY() * (high.y() - low.y()), style_.wall);
  }

  /// Opening in the plane z = 0 with its lower left corner at `corner`: reveals, window, sill, shutters.
  void window(const Vector3d& corner) {
    const Vector3d w = Vector3d::UnitX() * style_.window_width_m;
    const Vector3d h = Vector3d::UnitY() * style_.window_height_m;
    const Vector3d in = -Vector3d::UnitZ() * style_.recess_m;
    mesh_.rectangle(corner + in, w, h, {random_.pick(style_.windows), random_.uniform(0.75, 1.1), true});
    mesh_.rectangle(corner, in, h, style_.trim);
    mesh_.rectangle(corner + w + in, -in, h, style_.trim);
    mesh_.rectangle(corner + h + in, w, -in, style_.trim);
    mesh_.rectangle(corner, w, in, style_.trim);
    mesh_.box(corner + Vector3d(-0.08, -0.08, 0.0), corner + w + Vector3d(0.08, 0.0, 0.12), style_.trim);
    if (!style_.has_shutters) return;
    const Vector3d half = 0.5 * w;
    const Vector3d forward(0.0, 0.0, 0.05);
    mesh_.rectangle(corner + forward - half, half, h, style_.shutter);
    mesh_.rectangle(corner + forward + w, half, h, style_.shutter);
  }

  void balcony(const Vector3d& corner) {
    const double width = style_.window_width_m + 0.8;
    const Vector3d low = corner + Vector3d(-0.4, -style_.sill_height_m, 0.0);
    mesh_.box(low, low + Vector3d(width, 0.15, 1.1), style_.trim);
    mesh_.rectangle(low + Vector3d(0.0, 0.15, 1.05), Vector3d::UnitX() * width, Vector3d::UnitY() * 0.9,
                    style_.plinth);
    mesh_.rectangle(low + Vector3d(width, 0.15, 1.05), -Vector3d::UnitZ(), Vector3d::UnitY() * 0.9,
                    style_.plinth);
    mesh_.rectangle(low + Vector3d(0.0, 0.15, 0.05), Vector3d::UnitZ(), Vector3d::UnitY() * 0.9,
                    style_.plinth);
  }

  /// Shop window or door in front of a wall from x0 on.
  void entrance(double x0, double width_m, bool is_shop) {
    const double height = is_shop ? 2.6 : 2.15;
    const Vector3d w = Vector3d::UnitX() * width_m;
    const Vector3d h = Vector3d::UnitY() * height;
    const Vector3d corner(x0, 0.0, 0.06);
    const Paint frame{palette_.metal, random_.uniform(0.5, 1.4), false, random_.uniform(), random_.uniform()};
    mesh_.box({x0, -kFoundation_m, 0.0}, {x0 + width_m, height, 0.05}, frame);
    mesh_.rectangle(
        corner, w, h,
        {random_.pick(is_shop ? palette_.shops : palette_.doors), random_.uniform(0.8, 1.2), true});
    if (random_.chance(0.5)) {  // canopy
      mesh_.box({x0 - 0.2, height + 0.1, 0.0}, {x0 + width_m + 0.2, height + 0.22, random_.uniform(0.5, 1.2)},
                frame);
    }
  }

  void sign() {
    const double side = random_.uniform(0.5, 1.1);
    const double x = random_.uniform(0.2, std::max(0.3, size_.width_m - side - 0.5));
    const double y = style_.floor_height_m - 0.5;
    mesh_.box({x, y, 0.0}, {x + side, y + side, 0.1}, style_.trim);
    mesh_.rectangle({x, y, 0.11}, Vector3d::UnitX() * side, Vector3d::UnitY() * side,
                    {random_.pick(palette_.signs), 1.1, true});
  }

  /// Saddle roof over a body whose front left foot is the origin; the ridge runs along x.
  void saddle_roof() {
    const double eaves = eaves_m();
    const double w = size_.width_m;
    const double d = size_.depth_m;
    const double rise = 0.5 * d * std::tan(random_.uniform(0.45, 0.85));
    const double overhang = random_.uniform(0.3, 0.6);
    const double drop = overhang * rise / (0.5 * d);
    const Paint tiles = varied_paint(random_, random_.pick(palette_.roofs), 0.55, 1.1);
    const Vector3d along = Vector3d::UnitX() * (w + 2.0 * overhang);
    const Vector3d front(-overhang, eaves - drop, overhang);
    const Vector3d back(w + overhang, eaves - drop, -d - overhang);
    const Vector3d up_front(0.0, rise + drop, -(0.5 * d + overhang));
    const Vector3d up_back(0.0, rise + drop, 0.5 * d + overhang);
    mesh_.rectangle(front, along, up_front, tiles);
    mesh_.rectangle(back, -along, up_back, tiles);
    mesh_.rectangle(front + up_front, along, -up_front, style_.trim);  // undersides
    mesh_.rectangle(back + up_back, -along, -up_back, style_.trim);
    const Vector3d ridge_left(0.0, eaves + rise, -0.5 * d);
    const Vector3d ridge_right(w, eaves + rise, -0.5 * d);
    const Vector3d height = Vector3d::UnitY() * rise;
    mesh_.polygon({{0.0, eaves, -d}, {0.0, eaves, 0.0}, ridge_left}, Vector3d::UnitZ() * d, height,
                  style_.wall);
    mesh_.polygon({{w, eaves, 0.0}, {w, eaves, -d}, ridge_right}, -Vector3d::UnitZ() * d, height,
                  style_.wall);
    for (int i = random_.integer(1, 3); i > 0; --i) {  // chimneys
      const double x = random_.uniform(0.1, 0.85) * w;
      mesh_.box({x, eaves, -0.45 * d}, {x + 0.6, eaves + rise + random_.uniform(0.4, 1.1), -0.45 * d + 0.6},
                style_.plinth);
    }
    for (int i = random_.integer(0, 3); i > 0; --i) {  // skylights, lying on the front slope
      const Vector3d corner =
          front + 0.3 * up_front + along * random_.uniform(0.1, 0.8) + Vector3d(0.0, 0.05, 0.05);
      mesh_.rectangle(corner, Vector3d::UnitX(), up_front.normalized() * 1.2,
                      {palette_.windows.front(), 1.0, true});
    }
  }

  /// Flat roof behind a parapet, with boxes and masts on it.
  void flat_roof() {
    const double eaves = eaves_m();
    const double w = size_.width_m;
    const double d = size_.depth_m;
    mesh_.box({-0.15, eaves, -d - 0.15}, {w + 0.15, eaves + random_.uniform(0.3, 0.8), 0.15}, style_.trim);
    for (int i = random_.integer(1, 3); i > 0; --i) {
      const double x = random_.uniform(0.1, 0.7) * w;
      mesh_.box({x, eaves, -0.7 * d},
                {x + random_.uniform(1.0, 2.5), eaves + random_.uniform(1.0, 2.2), -0.3 * d}, style_.plinth);
    }
    const double mast = random_.uniform(2.0, 4.0);
    const double mast_x = random_.uniform(0.2, 0.8) * w;
    mesh_.column({{mast_x, eaves, -0.5 * d}, mast, 0.06, 0.03, 4}, {palette_.metal, 0.6});
  }

  Mesh& mesh_;
  Random& random_;
  const Palette& palette_;
  BuildingSize size_;
  Style style_;
};

}  // namespace

void add_building(Mesh& mesh, Random& random, const Palette& palette, const BuildingSize& size) {
  HouseBuilder(mesh, random, palette, size).build();
}

}  // namespace stereo_slam::simulator
