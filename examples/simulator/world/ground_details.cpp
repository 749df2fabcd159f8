// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>

#include "simulator/textures/random.hpp"
#include "simulator/world/ground.hpp"

namespace stereo_slam::simulator {
namespace {

/// Rectangle on the ground from `begin_m` to `end_m` along the station's direction and from `left_m` to
/// `right_m` across it (positive to the right), counter-clockwise in (x, z).
[[nodiscard]] std::vector<GroundPoint> strip(const Route::Station& station, double begin_m, double end_m,
                                             double left_m, double right_m) {
  const GroundPoint right(station.direction.y(), -station.direction.x());
  const auto at = [&](double along, double across) {
    return GroundPoint(station.position + along * station.direction + across * right);
  };
  return {at(begin_m, left_m), at(begin_m, right_m), at(end_m, right_m), at(end_m, left_m)};
}

/// Ragged round patch.
[[nodiscard]] std::vector<GroundPoint> blob(Random& random, const GroundPoint& centre, double radius_m) {
  constexpr int kCorners = 9;
  const double flattening = random.uniform(0.4, 1.0);
  const double turn = random.uniform(0.0, 2.0 * std::numbers::pi);
  std::vector<GroundPoint> polygon;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kCorners;
    const GroundPoint p(radius_m * std::cos(angle), flattening * radius_m * std::sin(angle));
    polygon.push_back(centre + GroundPoint(std::cos(turn) * p.x() - std::sin(turn) * p.y(),
                                           std::sin(turn) * p.x() + std::cos(turn) * p.y()));
  }
  return polygon;
}

/// Adds what is painted on the road or let into it. Long markings are added metre by metre, so that they
/// follow bends.
class Marker {
 public:
  Marker(const Site& site, std::vector<Face>& faces) : site_(site), faces_(faces), random_(site.seed, 4) {}

  void centre_line(const Route::Station& station) {
    constexpr double kDash_m = 3.0;
    constexpr double kPeriod_m = 7.0;
    const double phase = station.arc_m - kPeriod_m * std::floor(station.arc_m / kPeriod_m);
    if (phase < kDash_m) paint(strip(station, 0.0, 1.0, -1.72, -1.6), station, 1.9);
  }

  void edge_line(const Route::Station& station) { paint(strip(station, 0.0, 1.0, 2.5, 2.62), station, 1.7); }

  void zebra_crossing(const Route::Station& station) {
    const double edge = site_.street.road_half_width_m - 0.4;
    for (double x = -edge; x + 0.5 < edge; x += 1.0)
      lay(strip(station, 0.0, 3.0, x, x + 0.5), station, {site_.palette.paint, 2.56, 1.9, 0.016});
  }

  /// Line of a highway at `right_m` of the path; dashed between lanes.
  void lane_line(const Route::Station& station, double right_m, bool dashed) {
    constexpr double kDash_m = 4.0;
    constexpr double kPeriod_m = 12.0;
    constexpr double kHalfWidth_m = 0.075;
    const double phase = station.arc_m - kPeriod_m * std::floor(station.arc_m / kPeriod_m);
    if (dashed && phase >= kDash_m) return;
    paint(strip(station, 0.0, 1.0, right_m - kHalfWidth_m, right_m + kHalfWidth_m), station, 1.9);
  }

  void manhole(const Route::Station& station) {
    const double x = random_.uniform(-3.0, 3.0);
    lay(strip(station, 0.0, 0.7, x, x + 0.7), station,
        {site_.palette.kerb, 0.7, random_.uniform(0.4, 0.7), 0.009});
  }

  void mended_trench(const Route::Station& station) {
    const double x = random_.uniform(-3.5, 2.0);
    const double shade = random_.uniform(0.5, 0.95);
    const double width = random_.uniform(0.5, 1.6);
    const double length = random_.uniform(1.0, 5.0);
    lay(strip(station, 0.0, length, x, x + width), station, {site_.palette.asphalt, 7.3, shade, 0.006});
  }

  void patch_beside(const Route::Station& station) {
    const double side = random_.chance(0.5) ? 1.0 : -1.0;
    const GroundPoint right(station.direction.y(), -station.direction.x());
    const GroundPoint centre = station.position + side * random_.uniform(10.0, 26.0) * right;
    const double radius = random_.uniform(1.0, 3.5);
    if (site_.route.distance(centre, 30.0) < site_.street.pavement_end_m() + radius) return;
    Decal decal;
    decal.material = random_.pick(site_.palette.grounds);
    decal.period_m = 5.12;
    decal.brightness = random_.uniform(0.6, 1.0);
    decal.lift_m = 0.03;
    drape(site_, blob(random_, centre, radius), decal, faces_);
  }

 private:
  struct Look {
    MaterialId material;
    double period_m;
    double brightness;
    double lift_m = 0.012;
  };

  void lay(const std::vector<GroundPoint>& polygon, const Route::Station& station, const Look& look) {
    drape(site_, polygon, {look.material, look.period_m, look.brightness, look.lift_m, station.direction},
          faces_);
  }
  void paint(const std::vector<GroundPoint>& polygon, const Route::Station& station, double brightness) {
    lay(polygon, station, {site_.palette.paint, 2.56, brightness});
  }

  const Site& site_;
  std::vector<Face>& faces_;
  Random random_;
};

}  // namespace

void add_ground_details(const Site& site, std::vector<Face>& faces) {
  Marker marker(site, faces);
  Random random(site.seed, 5);
  double next_crossing = random.uniform(10.0, 60.0);
  for (const Route::Station& station : site.route.stations()) {
    if (!station.first_pass) continue;
    marker.centre_line(station);
    marker.edge_line(station);
    if (random.chance(0.09)) marker.manhole(station);
    if (random.chance(0.12)) marker.mended_trench(station);
    if (random.chance(0.5)) marker.patch_beside(station);
    if (station.arc_m < next_crossing) continue;
    marker.zebra_crossing(station);
    next_crossing = station.arc_m + random.uniform(50.0, 130.0);
  }
}

void add_highway_lines(const Site& site, std::vector<Face>& faces) {
  constexpr double kLane_m = 3.7;
  const double edge = site.street.road_half_width_m - 0.5;
  Marker marker(site, faces);
  Random random(site.seed, 5);
  for (const Route::Station& station : site.route.stations()) {
    if (!station.first_pass) continue;
    for (const double side : {1.0, -1.0}) {
      marker.lane_line(station, 0.5 * side * kLane_m, true);
      marker.lane_line(station, side * edge, false);
    }
    if (random.chance(0.02)) marker.mended_trench(station);
  }
}

void add_sky(const Site& site, std::vector<Face>& faces) {
  constexpr float kHeight_m = 1800.0F;
  constexpr float kTile_m = 9000.0F;
  const GroundPoint centre = 0.5 * (site.route.low() + site.route.high());
  const auto scale = static_cast<float>(1.0 / site.materials[site.palette.clouds].period_m);
  for (int i = -4; i < 4; ++i) {
    for (int j = -4; j < 4; ++j) {
      const Eigen::Vector3f low(static_cast<float>(centre.x()) + kTile_m * static_cast<float>(i), -kHeight_m,
                                static_cast<float>(centre.y()) + kTile_m * static_cast<float>(j));
      const Eigen::Vector3f x(kTile_m, 0.0F, 0.0F);
      const Eigen::Vector3f z(0.0F, 0.0F, kTile_m);
      Face face;
      face.material = site.palette.clouds;
      face.brightness = 2.05F;
      face.corners = {low, low + z, low + x + z, low + x};  // seen from below
      face.u_axis = {scale, 0.0F, 0.0F};
      face.v_axis = {0.0F, 0.0F, scale};
      faces.push_back(face);
    }
  }
}

}  // namespace stereo_slam::simulator
