// SPDX-License-Identifier: MIT
#include "simulator/world/traffic.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulator/textures/random.hpp"
#include "simulator/world/mesh.hpp"
#include "simulator/world/props.hpp"

namespace stereo_slam::simulator {
namespace {

constexpr double kOncomingCycle_m = 150.0;
constexpr double kOncomingBehind_m = 25.0;
constexpr double kJamSpacing_m = 7.5;   ///< of oncoming vehicles in a jam, from middle to middle
constexpr double kSpacingJitter = 0.2;  ///< of the spacing
constexpr double kAheadSwing_m = 5.0;
constexpr double kSparse = 8.0;  ///< with more vehicles, the distance of those ahead varies less
constexpr double kAheadPeriod_s = 23.0;

[[nodiscard]] double wrap(double x, double period) { return x - period * std::floor(x / period); }

/// Face of an object at the origin, moved to T_world_object; its texture moves with it.
[[nodiscard]] Face moved(const Face& face, const Eigen::Isometry3d& T_world_object) {
  Face result = face;
  for (Eigen::Vector3f& corner : result.corners)
    corner = (T_world_object * corner.cast<double>()).cast<float>();
  const auto turn = [&](const Eigen::Vector3f& axis) -> Eigen::Vector3f {
    return (T_world_object.linear() * axis.cast<double>()).cast<float>();
  };
  result.u_axis = turn(face.u_axis);
  result.v_axis = turn(face.v_axis);
  const Eigen::Vector3f origin = T_world_object.translation().cast<float>();
  result.u_offset -= result.u_axis.dot(origin);
  result.v_offset -= result.v_axis.dot(origin);
  return result;
}

}  // namespace

Traffic::Traffic(const World& world, const CameraPath& path, double fps, int vehicles, std::uint64_t seed)
    : world_(&world), fps_(fps) {
  // The sum of all steps on the ground. The route's stations are a metre apart and leave out smaller motions,
  // such as the jitter of a standing camera, so that their arc lengths may be smaller.
  double arc_m = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i > 0) {
      const Eigen::Vector3d step = path[i].translation() - path[i - 1].translation();
      arc_m += std::hypot(step.x(), step.z());
    }
    arcs_m_.push_back(arc_m);
  }
  Random random(seed, 7);
  const int oncoming = vehicles / 2;
  const StreetProfile& street = world.street();
  oncoming_speed_m_s_ = random.uniform(street.slowest_m_s, street.fastest_m_s);
  oncoming_cycle_m_ = std::max(kOncomingCycle_m, kJamSpacing_m * oncoming);
  ahead_swing_m_ = kAheadSwing_m * std::min(1.0, kSparse / std::max(1, vehicles));
  double ahead_m = street.least_gap_m;
  for (int i = 0; i < vehicles; ++i) {
    Vehicle vehicle;
    vehicle.oncoming = i % 2 == 1;
    if (vehicle.oncoming) {
      const int pair = i / 2;
      const double place = pair + random.uniform(0.0, kSpacingJitter);
      vehicle.distance_m = place / oncoming * oncoming_cycle_m_;
    } else {
      vehicle.distance_m = ahead_m;
      ahead_m += random.uniform(16.0, 24.0);
    }
    vehicle.phase_rad = random.uniform(0.0, 2.0 * std::numbers::pi);
    Mesh mesh(world.scene().materials, vehicle.faces);
    mesh.place(Eigen::Isometry3d(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX())));
    const auto add_vehicle = i % 4 < 2 ? add_lorry : add_car;
    add_vehicle(mesh, random, world.palette());
    vehicles_.push_back(std::move(vehicle));
  }
}

double Traffic::camera_arc_m(std::size_t frame, double later) const {
  if (arcs_m_.size() < 2) return arcs_m_.at(frame);
  const PathTime at = path_time(arcs_m_.size(), frame, later);
  return arcs_m_[at.frame] + at.share * (arcs_m_[at.step + 1] - arcs_m_[at.step]);
}

double Traffic::arc_m(const Vehicle& vehicle, std::size_t frame, double later) const {
  const double time_s = (static_cast<double>(frame) + later) / fps_;
  const double camera_m = camera_arc_m(frame, later);
  if (vehicle.oncoming) {
    const double relative_m = vehicle.distance_m - oncoming_speed_m_s_ * time_s - camera_m;
    return camera_m + wrap(relative_m + kOncomingBehind_m, oncoming_cycle_m_) - kOncomingBehind_m;
  }
  const double swing = std::sin(2.0 * std::numbers::pi * time_s / kAheadPeriod_s + vehicle.phase_rad);
  return camera_m + vehicle.distance_m + ahead_swing_m_ * (1.0 + swing);
}

std::vector<Face> Traffic::at(std::size_t frame, double later) const {
  std::vector<Face> faces;
  const auto& stations = world_->route().stations();
  for (const Vehicle& vehicle : vehicles_) {
    const double arc = arc_m(vehicle, frame, later);
    if (arc < stations.front().arc_m || arc > stations.back().arc_m) continue;  // off the ends of the road
    const Route::Station station = world_->route().at_arc(arc);
    const GroundPoint left(-station.direction.y(), station.direction.x());
    const GroundPoint position =
        station.position + (vehicle.oncoming ? world_->street().oncoming_lane_m : 0.0) * left;
    const GroundPoint heading = vehicle.oncoming ? GroundPoint(-station.direction) : station.direction;
    const Eigen::Isometry3d T_world_vehicle = stand(position, heading, world_->terrain().height(position)) *
                                              Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX());
    for (const Face& face : vehicle.faces) faces.push_back(moved(face, T_world_vehicle));
  }
  return faces;
}

}  // namespace stereo_slam::simulator
