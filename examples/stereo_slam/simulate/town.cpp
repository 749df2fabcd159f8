// SPDX-License-Identifier: MIT
#include "town.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "buildings.hpp"
#include "props.hpp"

namespace stereo_slam::simulate {
namespace {

/// Where something of the given size could stand beside a station of the route.
struct Slot {
  GroundBox box;
  GroundPoint front;  ///< unit direction towards the street
  double ground_y = 0.0;
};

/// Keeps things off the route and off each other.
class Plan {
 public:
  explicit Plan(const TownSite& site) : site_(site) {}

  /// Rectangle of `length_m` along the street and `depth_m` away from it, whose near side is `offset_m` from
  /// the path on the right (`side` = 1) or on the left (-1) of a station.
  [[nodiscard]] Slot slot(const Route::Station& station, double side, double offset_m, double length_m,
                          double depth_m) const {
    const GroundPoint right(station.direction.y(), -station.direction.x());
    Slot slot;
    slot.front = -side * right;
    slot.box = {station.position + side * (offset_m + 0.5 * depth_m) * right, station.direction,
                0.5 * length_m, 0.5 * depth_m};
    slot.ground_y = site_.terrain.height(slot.box.centre);
    return slot;
  }

  /// Takes the place when it is free and `clearance_m` away from the route.
  [[nodiscard]] bool take(const GroundBox& box, double clearance_m) {
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

 private:
  static constexpr double kCell_m = 16.0;
  static constexpr double kLargestReach_m = 20.0;
  [[nodiscard]] static int cell(double x) { return static_cast<int>(std::floor(x / kCell_m)); }

  const TownSite& site_;
  std::map<std::pair<int, int>, std::vector<GroundBox>> taken_;
};

/// The builders' common tools.
struct Yard {
  const TownSite& site;
  Plan plan;
  Mesh mesh;
  Random random;

  void place(const Slot& slot) { mesh.place(stand(slot.box.centre, slot.front, slot.ground_y)); }
};

/// Whether the houses of this stretch stand wall to wall at the pavement, or apart in gardens; a property of
/// the place.
[[nodiscard]] bool is_dense(const Route::Station& station, double side) {
  const GroundPoint& p = station.position;
  return std::sin(0.021 * p.x() + 1.3 * side) + std::sin(0.019 * p.y() - 0.7 * side) > -0.1;
}

/// One row of houses; `row_offset_m` is 0 at the street and larger behind.
void add_houses(Yard& yard, double row_offset_m) {
  const double pavement = yard.site.street.pavement_end_m();
  for (const double side : {1.0, -1.0}) {
    double next_arc = -Route::kRunOut_m;
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

/// How often a kind of thing stands along the street.
struct Spread {
  double offset_low_m;  ///< distance of its near side from the path
  double offset_high_m;
  double spacing_low_m;
  double spacing_high_m;
  double length_m;
  double depth_m;
  double clearance_m;  ///< from the path
};

/// Spreads things along one side of the street; build(slot) adds one.
template <class Build>
void spread(Yard& yard, double side, const Spread& how, Build build) {
  double next_arc = -Route::kRunOut_m + yard.random.uniform(0.0, how.spacing_high_m);
  for (const Route::Station& station : yard.site.route.stations()) {
    if (station.arc_m < next_arc) continue;
    const double offset = yard.random.uniform(how.offset_low_m, how.offset_high_m);
    const Slot slot = yard.plan.slot(station, side, offset, how.length_m, how.depth_m);
    next_arc = station.arc_m + yard.random.uniform(how.spacing_low_m, how.spacing_high_m);
    if (!yard.plan.take(slot.box, how.clearance_m)) continue;
    yard.place(slot);
    build(slot);
  }
}

void add_parked_cars(Yard& yard) {
  const double width = CarSize::kWidth_m;
  for (const double side : {1.0, -1.0}) {
    const double offset = side > 0.0 ? 2.9 : 3.35;  // oncoming traffic needs the left
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

/// Trees on the land around the streets, which close the gaps between the houses.
void add_woods(Yard& yard) {
  constexpr double kMargin_m = 160.0;
  constexpr double kArea_m2 = 500.0;  ///< of land for a tree
  constexpr int kMost = 3000;
  const GroundPoint low = yard.site.route.low() - GroundPoint::Constant(kMargin_m);
  const GroundPoint high = yard.site.route.high() + GroundPoint::Constant(kMargin_m);
  const int trees = static_cast<int>(std::min<double>((high - low).prod() / kArea_m2, kMost));
  for (int i = 0; i < trees; ++i) {
    const GroundPoint position(yard.random.uniform(low.x(), high.x()),
                               yard.random.uniform(low.y(), high.y()));
    const GroundBox box{position, GroundPoint::UnitX(), 2.0, 2.0};
    if (!yard.plan.take(box, 30.0)) continue;
    yard.mesh.place(stand(position, GroundPoint::UnitX(), yard.site.terrain.height(position)));
    add_tree(yard.mesh, yard.random, yard.site.palette, yard.random.uniform(6.0, 15.0), TreeDetail::kFar);
  }
}

}  // namespace

void add_town(const TownSite& site, std::vector<Face>& faces) {
  Yard yard{site, Plan(site), Mesh(site.materials, faces), Random(site.seed, 3)};
  add_parked_cars(yard);
  add_houses(yard, 0.0);
  add_furniture(yard);
  add_plants(yard);
  add_houses(yard, 18.0);
  add_houses(yard, 36.0);
  add_woods(yard);
}

}  // namespace stereo_slam::simulate
