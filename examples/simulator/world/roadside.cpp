// SPDX-License-Identifier: MIT
#include "simulator/world/roadside.hpp"

#include <algorithm>
#include <cmath>

#include "simulator/world/props.hpp"

namespace stereo_slam::simulator {

double rise_m(const Site& site, const Slot& slot) {
  const GroundPoint right = slot.box.half_length_m * GroundPoint(-slot.front.y(), slot.front.x());
  return site.terrain.height(slot.box.centre - right) - site.terrain.height(slot.box.centre + right);
}

int Plan::cell(double x) { return static_cast<int>(std::floor(x / kCell_m)); }

Slot Plan::slot(const Route::Station& station, double side, double offset_m, double length_m,
                double depth_m) const {
  const GroundPoint right(station.direction.y(), -station.direction.x());
  Slot slot;
  slot.front = -side * right;
  slot.box = {station.position + side * (offset_m + 0.5 * depth_m) * right, station.direction, 0.5 * length_m,
              0.5 * depth_m};
  slot.ground_y = site_.terrain.height(slot.box.centre);
  return slot;
}

bool Plan::take(const GroundBox& box, double clearance_m) {
  if (!site_.route.is_clear(box, clearance_m)) return false;
  const double reach = std::hypot(box.half_length_m, box.half_width_m) + kLargestReach_m;
  for (int i = cell(box.centre.x() - reach); i <= cell(box.centre.x() + reach); ++i) {
    for (int j = cell(box.centre.y() - reach); j <= cell(box.centre.y() + reach); ++j) {
      const auto members = taken_.find({i, j});
      if (members == taken_.end()) continue;
      for (const GroundBox& other : members->second) {
        if (box.overlaps(other)) return false;
      }
    }
  }
  taken_[{cell(box.centre.x()), cell(box.centre.y())}].push_back(box);
  return true;
}

void add_woods(Yard& yard) {
  constexpr double kMargin_m = 160.0;
  constexpr double kArea_m2 = 500.0;  ///< area of land for each tree
  constexpr int kMost = 3000;
  const GroundPoint low = yard.site.route.low() - GroundPoint::Constant(kMargin_m);
  const GroundPoint high = yard.site.route.high() + GroundPoint::Constant(kMargin_m);
  const int trees = static_cast<int>(std::min<double>((high - low).prod() / kArea_m2, kMost));
  for (int i = 0; i < trees; ++i) {
    const double y = yard.random.uniform(low.y(), high.y());
    const double x = yard.random.uniform(low.x(), high.x());
    const GroundPoint position(x, y);
    const GroundBox box{position, GroundPoint::UnitX(), 2.0, 2.0};
    if (!yard.plan.take(box, 30.0)) continue;
    yard.mesh.place(stand(position, GroundPoint::UnitX(), yard.site.terrain.height(position)));
    add_tree(yard.mesh, yard.random, yard.site.palette, yard.random.uniform(6.0, 15.0), TreeDetail::kFar);
  }
}

}  // namespace stereo_slam::simulator
