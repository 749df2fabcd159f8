// SPDX-License-Identifier: MIT
#include "simulator/world/town.hpp"

#include <algorithm>
#include <cmath>

#include "simulator/world/buildings.hpp"
#include "simulator/world/props.hpp"
#include "simulator/world/roadside.hpp"

namespace stereo_slam::simulator {
namespace {

/// Whether the houses here stand wall to wall at the pavement, or apart in gardens; depends only on the
/// place.
[[nodiscard]] bool is_dense(const Route::Station& station, double side) {
  const GroundPoint& p = station.position;
  return std::sin(0.021 * p.x() + 1.3 * side) + std::sin(0.019 * p.y() - 0.7 * side) > -0.1;
}

/// One row of houses; `row_offset_m` is 0 for the row at the street, and larger for rows behind it.
void add_houses(Yard& yard, double row_offset_m) {
  const double pavement = yard.site.street.pavement_end_m();
  for (const double side : {1.0, -1.0}) {
    double next_arc = -yard.site.route.run_out_m();
    for (const Route::Station& station : yard.site.route.stations()) {
      if (station.arc_m < next_arc) continue;
      const bool dense = is_dense(station, side);
      const BuildingSize size{yard.random.uniform(7.0, dense ? 17.0 : 13.0), yard.random.uniform(8.0, 11.0),
                              dense ? yard.random.integer(2, 5) : yard.random.integer(1, 3)};
      const double setback =
          row_offset_m + (dense ? yard.random.uniform(0.1, 0.6) : yard.random.uniform(2.5, 6.0));
      const double gap = dense ? (yard.random.chance(0.8) ? 0.05 : 3.0) : yard.random.uniform(2.5, 7.0);
      const Slot slot = yard.plan.slot(station, side, pavement + setback, size.width_m, size.depth_m);
      // The station is the middle of the house; try again a metre on where it does not fit.
      if (!yard.plan.take(slot.box, pavement + 0.1)) continue;
      yard.mesh.place(stand(slot.box.centre + 0.5 * size.depth_m * slot.front, slot.front, slot.ground_y));
      add_building(yard.mesh, yard.random, yard.site.palette, size);
      next_arc = station.arc_m + size.width_m + gap;
      if (row_offset_m > 0.0 || dense) continue;
      const double length = size.width_m + 0.5 * gap;  // the garden's boundary
      const Slot fence = yard.plan.slot(station, side, pavement + 0.3, length, 0.8);
      if (!yard.plan.take(fence.box, pavement)) continue;
      yard.place(fence);
      add_boundary(yard.mesh, yard.random, yard.site.palette, length);
    }
  }
}

void add_parked_cars(Yard& yard) {
  const double width = CarSize::kWidth_m;
  for (const double side : {1.0, -1.0}) {
    const double offset = side > 0.0 ? 2.9 : 3.35;  // leaves room for oncoming traffic on the left
    const Spread how{offset, offset + 0.15, 5.2, 17.0, CarSize::kLength_m + 0.5, width, 2.6};
    spread(yard, side, how, [&](const Slot& slot) {
      const GroundPoint heading =
          yard.random.chance(0.85) ? GroundPoint(side * slot.box.along) : GroundPoint(-side * slot.box.along);
      const double road_y = yard.site.terrain.height(slot.box.centre + slot.front);
      yard.mesh.place(stand(slot.box.centre, heading, std::min(road_y, slot.ground_y)));
      add_car(yard.mesh, yard.random, yard.site.palette);
    });
  }
}

void add_furniture(Yard& yard) {
  const double kerb = yard.site.street.pavement_begin_m();
  const double pavement = yard.site.street.pavement_end_m();
  const Palette& palette = yard.site.palette;
  for (const double side : {1.0, -1.0}) {
    spread(yard, side, {kerb + 0.25, kerb + 0.35, 22.0, 34.0, 0.4, 0.4, kerb},
           [&](const Slot&) { add_lamp(yard.mesh, yard.random, palette); });
    spread(yard, side, {kerb + 0.3, kerb + 0.6, 12.0, 40.0, 0.4, 0.3, kerb}, [&](const Slot& slot) {
      const GroundPoint facing = (-side * slot.box.along + 0.4 * slot.front).normalized();
      yard.mesh.place(stand(slot.box.centre, facing, slot.ground_y));
      add_sign(yard.mesh, yard.random, palette);
    });
    spread(yard, side, {kerb + 0.7, kerb + 1.2, 10.0, 26.0, 1.6, 1.2, kerb}, [&](const Slot&) {
      add_tree(yard.mesh, yard.random, palette, yard.random.uniform(5.0, 9.0), TreeDetail::kNear);
    });
    spread(yard, side, {kerb + 0.3, pavement - 0.7, 6.0, 22.0, 0.9, 0.5, kerb},
           [&](const Slot&) { add_box(yard.mesh, yard.random, palette); });
  }
}

void add_plants(Yard& yard) {
  const double pavement = yard.site.street.pavement_end_m();
  const Palette& palette = yard.site.palette;
  for (const double side : {1.0, -1.0}) {
    spread(yard, side, {pavement + 0.5, pavement + 6.0, 2.0, 9.0, 1.3, 1.3, pavement},
           [&](const Slot&) { add_bush(yard.mesh, yard.random, palette, yard.random.uniform(0.7, 1.9)); });
    spread(yard, side, {pavement + 1.5, pavement + 9.0, 4.0, 14.0, 2.5, 2.5, pavement + 0.5},
           [&](const Slot&) {
             add_tree(yard.mesh, yard.random, palette, yard.random.uniform(5.0, 12.0), TreeDetail::kNear);
           });
    spread(yard, side, {pavement + 14.0, pavement + 45.0, 3.0, 14.0, 4.0, 4.0, pavement + 3.0},
           [&](const Slot&) {
             add_tree(yard.mesh, yard.random, palette, yard.random.uniform(8.0, 16.0), TreeDetail::kFar);
           });
  }
}

}  // namespace

void add_town(const Site& site, std::vector<Face>& faces) {
  Yard yard{site, Plan(site), Mesh(site.materials, faces), Random(site.seed, 3)};
  add_parked_cars(yard);
  add_houses(yard, 0.0);
  add_furniture(yard);
  add_plants(yard);
  add_houses(yard, 18.0);
  add_houses(yard, 36.0);
  add_woods(yard);
}

}  // namespace stereo_slam::simulator
