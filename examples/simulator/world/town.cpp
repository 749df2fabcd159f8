// SPDX-License-Identifier: MIT
#include "simulator/world/town.hpp"

#include <algorithm>
#include <cmath>

#include "simulator/world/houses.hpp"
#include "simulator/world/props.hpp"
#include "simulator/world/roadside.hpp"

namespace stereo_slam::simulator {
namespace {

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
