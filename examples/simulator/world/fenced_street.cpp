// SPDX-License-Identifier: MIT
#include "simulator/world/fenced_street.hpp"

#include <optional>

#include "simulator/world/houses.hpp"
#include "simulator/world/props.hpp"
#include "simulator/world/roadside.hpp"

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

/// A piece of a fence over the length of the slot: pickets in front of two bars. `begin_m` is the length of
/// the fence up to the left end.
void add_piece(Yard& yard, const Slot& slot, double begin_m) {
  constexpr double kHeight_m = 1.2;
  const double length_m = 2.0 * slot.box.half_length_m;
  const double rise = rise_m(yard.site, slot);
  const MaterialId fence = yard.site.palette.fence;
  const Vector3d along(length_m, rise, 0.0);
  const Vector3d left(-0.5 * length_m, -0.5 * rise, 0.0);
  yard.place(slot);
  yard.mesh.rectangle(left, along, kHeight_m * Vector3d::UnitY(),
                      {fence, 1.5, false, begin_m / yard.site.materials[fence].period_m, 0.0});
  for (const double height_m : {0.3, 0.85}) {
    yard.mesh.rectangle(left + Vector3d(0.0, height_m, -0.04), along, 0.08 * Vector3d::UnitY(),
                        {yard.site.palette.metal, 1.2});
  }
}

/// A fence without gaps along one side of the street.
void add_fence(Yard& yard, double side) {
  constexpr double kPiece_m = 2.0;
  constexpr double kThickness_m = 0.05;
  const double offset = yard.site.street.pavement_end_m() - 0.35;
  std::optional<GroundPoint> begin;
  double length_m = 0.0;
  double next_arc = -yard.site.route.run_out_m();
  for (const Route::Station& station : yard.site.route.stations()) {
    if (station.arc_m < next_arc) continue;
    next_arc = station.arc_m + kPiece_m;
    const GroundPoint right(station.direction.y(), -station.direction.x());
    const GroundPoint end = station.position + side * offset * right;
    if (begin && (end - *begin).dot(station.direction) > 0.0) {
      const GroundPoint along = (end - *begin).normalized();
      Slot slot;
      slot.box = {0.5 * (*begin + end), along, 0.5 * (end - *begin).norm(), 0.5 * kThickness_m};
      slot.front = -side * GroundPoint(along.y(), -along.x());
      slot.ground_y = yard.site.terrain.height(slot.box.centre);
      const double piece_m = 2.0 * slot.box.half_length_m;
      // Seen from the street, the one on the right begins at its left end.
      if (yard.site.route.is_clear(slot.box, offset - 0.5))
        add_piece(yard, slot, side > 0.0 ? length_m : -length_m - piece_m);
      length_m += piece_m;
    }
    begin = end;
  }
}

}  // namespace

void add_fenced_street(const Site& site, std::vector<Face>& faces) {
  Yard yard{site, Plan(site), Mesh(site.materials, faces), Random(site.seed, 3)};
  const double pavement = site.street.pavement_end_m();
  const double kerb = site.street.pavement_begin_m();
  for (const double side : {1.0, -1.0}) add_fence(yard, side);
  add_houses(yard, 0.0);
  for (const double side : {1.0, -1.0}) {
    spread(yard, side, {kerb + 0.25, kerb + 0.35, 22.0, 34.0, 0.4, 0.4, kerb},
           [&](const Slot&) { add_lamp(yard.mesh, yard.random, site.palette); });
    spread(
        yard, side, {pavement + 1.5, pavement + 9.0, 12.0, 40.0, 2.5, 2.5, pavement + 0.5}, [&](const Slot&) {
          add_tree(yard.mesh, yard.random, site.palette, yard.random.uniform(5.0, 12.0), TreeDetail::kNear);
        });
  }
  add_houses(yard, 18.0);
  add_woods(yard);
}

}  // namespace stereo_slam::simulator
