// SPDX-License-Identifier: MIT
#include "simulator/world/houses.hpp"

#include <cmath>

#include "simulator/world/buildings.hpp"
#include "simulator/world/props.hpp"

namespace stereo_slam::simulator {
namespace {

/// Whether the houses here stand wall to wall at the pavement, or apart in gardens; depends only on the
/// place.
[[nodiscard]] bool is_dense(const Route::Station& station, double side) {
  const GroundPoint& p = station.position;
  return std::sin(0.021 * p.x() + 1.3 * side) + std::sin(0.019 * p.y() - 0.7 * side) > -0.1;
}

}  // namespace

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

}  // namespace stereo_slam::simulator
