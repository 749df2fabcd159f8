// SPDX-License-Identifier: MIT
#include "simulator/world/highway.hpp"

#include <cmath>

#include "simulator/world/buildings.hpp"
#include "simulator/world/highway_furniture.hpp"
#include "simulator/world/props.hpp"
#include "simulator/world/roadside.hpp"

namespace stereo_slam::simulator {
namespace {

/// Whether the road has a guard rail here; depends only on the place.
[[nodiscard]] bool has_rail(const GroundPoint& p, double side) {
  return std::sin(0.017 * p.x() + 1.9 * side) + std::sin(0.013 * p.y() - 0.8 * side) > 0.2;
}

/// Gantries across the carriageway; their legs stand behind the rails.
void add_gantries(Yard& yard) {
  const double offset = yard.site.street.pavement_end_m() + 1.4;
  double next_arc = -yard.site.route.run_out_m() + yard.random.uniform(40.0, 300.0);
  for (const Route::Station& station : yard.site.route.stations()) {
    if (station.arc_m < next_arc || !station.first_pass) continue;
    next_arc = station.arc_m + yard.random.uniform(180.0, 380.0);
    const auto leg = [&](double side) {
      return yard.plan.slot(station, side, offset, 2.0 * kGantryFoot_m, 2.0 * kGantryFoot_m);
    };
    if (!yard.plan.take(leg(1.0).box, offset - 0.1) || !yard.plan.take(leg(-1.0).box, offset - 0.1)) continue;
    yard.mesh.place(stand(station.position, -station.direction, yard.site.terrain.height(station.position)));
    add_gantry(yard.mesh, yard.random, yard.site.palette, offset + kGantryFoot_m);
  }
}

void add_rails(Yard& yard) {
  constexpr double kPiece_m = 4.0;
  const double offset = yard.site.street.pavement_end_m() - 0.3;
  for (const double side : {1.0, -1.0}) {
    double next_arc = -yard.site.route.run_out_m();
    for (const Route::Station& station : yard.site.route.stations()) {
      if (station.arc_m < next_arc) continue;
      next_arc = station.arc_m + kPiece_m;
      const Slot slot = yard.plan.slot(station, side, offset, kPiece_m + 0.1, 0.3);  // ends overlap in bends
      if (!has_rail(station.position, side)) continue;
      if (!yard.site.route.is_clear(slot.box, offset - 0.2)) continue;
      yard.place(slot);
      add_guard_rail(yard.mesh, yard.random, yard.site.palette, kPiece_m + 0.1, rise_m(yard.site, slot));
    }
  }
}

void add_signs(Yard& yard) {
  const double edge = yard.site.street.pavement_end_m();
  const Palette& palette = yard.site.palette;
  for (const double side : {1.0, -1.0}) {
    spread(yard, side, {edge + 0.2, edge + 0.2, 50.0, 50.0, 0.2, 0.2, edge},
           [&](const Slot&) { add_delineator(yard.mesh, palette); });
    const auto face_traffic = [&](const Slot& slot) {
      yard.mesh.place(stand(slot.box.centre, -side * slot.box.along, slot.ground_y));
    };
    spread(yard, side, {edge + 1.2, edge + 2.5, 60.0, 180.0, 0.4, 0.9, edge + 0.5}, [&](const Slot& slot) {
      face_traffic(slot);
      add_sign(yard.mesh, yard.random, palette);
    });
    spread(yard, side, {edge + 1.5, edge + 4.0, 130.0, 320.0, 0.6, 3.0, edge + 0.5}, [&](const Slot& slot) {
      face_traffic(slot);
      add_direction_board(yard.mesh, yard.random, palette);
    });
  }
}

/// Farmhouses beyond the fields.
void add_farms(Yard& yard) {
  for (const double side : {1.0, -1.0}) {
    const Spread how{90.0, 170.0, 90.0, 260.0, 16.0, 12.0, 60.0};
    spread(yard, side, how, [&](const Slot&) {
      const BuildingSize size{yard.random.uniform(9.0, 15.0), yard.random.uniform(8.0, 11.0),
                              yard.random.integer(1, 2)};
      add_building(yard.mesh, yard.random, yard.site.palette, size);
    });
  }
}

void add_plants(Yard& yard) {
  const double edge = yard.site.street.pavement_end_m();
  const Palette& palette = yard.site.palette;
  const auto tree = [&](const Slot&) {
    add_tree(yard.mesh, yard.random, palette, yard.random.uniform(6.0, 15.0), TreeDetail::kFar);
  };
  for (const double side : {1.0, -1.0}) {
    spread(yard, side, {edge + 7.0, edge + 22.0, 3.0, 16.0, 2.0, 2.0, edge + 5.0},
           [&](const Slot&) { add_bush(yard.mesh, yard.random, palette, yard.random.uniform(0.8, 2.6)); });
    spread(yard, side, {edge + 11.0, edge + 28.0, 9.0, 40.0, 4.0, 4.0, edge + 9.0}, tree);
    spread(yard, side, {40.0, 80.0, 3.0, 12.0, 4.0, 4.0, 30.0}, tree);
    spread(yard, side, {45.0, 110.0, 10.0, 45.0, 22.0, 1.0, 30.0},
           [&](const Slot&) { add_boundary(yard.mesh, yard.random, palette, 21.0); });
  }
}

}  // namespace

void add_highway(const Site& site, std::vector<Face>& faces) {
  Yard yard{site, Plan(site), Mesh(site.materials, faces), Random(site.seed, 3)};
  add_gantries(yard);
  add_rails(yard);
  add_signs(yard);
  add_farms(yard);
  add_plants(yard);
  add_woods(yard);
}

}  // namespace stereo_slam::simulator
