// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "simulator/textures/random.hpp"
#include "simulator/world/mesh.hpp"
#include "simulator/world/site.hpp"

/// Tools to place objects along a street.
namespace stereo_slam::simulator {

/// Place for an object beside a station of the route.
struct Slot {
  GroundBox box;
  GroundPoint front;  ///< unit direction towards the street
  double ground_y = 0.0;
};

/// Height of the ground at the right end of a slot minus the height at its left end, as seen looking at its
/// front.
[[nodiscard]] double rise_m(const Site& site, const Slot& slot);

/// Keeps objects off the route and apart from each other.
class Plan {
 public:
  explicit Plan(const Site& site) : site_(site) {}

  /// Rectangle of `length_m` along the street and `depth_m` away from it, whose near side is `offset_m` from
  /// the path on the right (`side` = 1) or on the left (-1) of a station.
  [[nodiscard]] Slot slot(const Route::Station& station, double side, double offset_m, double length_m,
                          double depth_m) const;

  /// Reserves the place if it is free and at least `clearance_m` away from the route. Returns whether it did.
  [[nodiscard]] bool take(const GroundBox& box, double clearance_m);

 private:
  static constexpr double kCell_m = 16.0;
  static constexpr double kLargestReach_m = 20.0;
  [[nodiscard]] static int cell(double x);

  const Site& site_;
  std::map<std::pair<int, int>, std::vector<GroundBox>> taken_;
};

/// What the functions that place objects share.
struct Yard {
  const Site& site;
  Plan plan;
  Mesh mesh;
  Random random;

  void place(const Slot& slot) { mesh.place(stand(slot.box.centre, slot.front, slot.ground_y)); }
};

/// How densely one kind of object stands along the street.
struct Spread {
  double offset_low_m;  ///< distance of its near side from the path
  double offset_high_m;
  double spacing_low_m;
  double spacing_high_m;
  double length_m;
  double depth_m;
  double clearance_m;  ///< from the path
};

/// Places objects along one side of the street; build(slot) adds one.
template <class Build>
void spread(Yard& yard, double side, const Spread& how, Build build) {
  double next_arc = -yard.site.route.run_out_m() + yard.random.uniform(0.0, how.spacing_high_m);
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

/// Trees on the land around the street.
void add_woods(Yard& yard);

}  // namespace stereo_slam::simulator
