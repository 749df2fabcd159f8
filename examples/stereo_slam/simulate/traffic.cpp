// SPDX-License-Identifier: MIT
#include "traffic.hpp"

#include <cmath>
#include <numbers>

#include "mesh.hpp"
#include "props.hpp"
#include "random.hpp"

namespace stereo_slam::simulate {
namespace {

constexpr double kOncomingLane_m = 2.35;  ///< to the left of the camera's path
constexpr double kOncomingCycle_m = 190.0;
constexpr double kOncomingBehind_m = 25.0;
constexpr double kAheadSwing_m = 5.0;
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

Traffic::Traffic(const World& world, const CameraPath& path, double fps, int cars, std::uint64_t seed)
    : world_(&world), fps_(fps) {
  // The route's stations count the distance in the same way: metre by metre, without what is lost standing
  // still.
  double arc_m = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i > 0) {
      const Eigen::Vector3d step = path[i].translation() - path[i - 1].translation();
      arc_m += std::hypot(step.x(), step.z());
    }
    arcs_m_.push_back(arc_m);
  }
  Random random(seed, 7);
  double ahead_m = 11.0;
  for (int i = 0; i < cars; ++i) {
    Car car;
    car.oncoming = i % 2 == 1;
    car.distance_m = car.oncoming ? random.uniform(0.0, kOncomingCycle_m) : ahead_m;
    if (!car.oncoming) ahead_m += random.uniform(16.0, 24.0);
    car.speed_m_s = random.uniform(6.0, 11.0);
    car.phase_rad = random.uniform(0.0, 2.0 * std::numbers::pi);
    Mesh mesh(world.scene().materials, car.faces);
    mesh.place(Eigen::Isometry3d(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX())));
    add_car(mesh, random, world.palette());
    cars_.push_back(std::move(car));
  }
}

std::vector<Face> Traffic::at(std::size_t frame) const {
  const double time_s = static_cast<double>(frame) / fps_;
  const double camera_m = arcs_m_.at(frame);
  std::vector<Face> faces;
  for (const Car& car : cars_) {
    double arc_m = 0.0;
    if (car.oncoming) {
      const double relative = car.distance_m - car.speed_m_s * time_s - camera_m;
      arc_m = camera_m + wrap(relative + kOncomingBehind_m, kOncomingCycle_m) - kOncomingBehind_m;
    } else {
      const double swing = std::sin(2.0 * std::numbers::pi * time_s / kAheadPeriod_s + car.phase_rad);
      arc_m = camera_m + car.distance_m + kAheadSwing_m * (1.0 + swing);
    }
    const auto& stations = world_->route().stations();
    if (arc_m < stations.front().arc_m || arc_m > stations.back().arc_m)
      continue;  // off the ends of the road
    const Route::Station station = world_->route().at_arc(arc_m);
    const GroundPoint left(-station.direction.y(), station.direction.x());
    const GroundPoint position = station.position + (car.oncoming ? kOncomingLane_m : 0.0) * left;
    const GroundPoint heading = car.oncoming ? GroundPoint(-station.direction) : station.direction;
    const Eigen::Isometry3d T_world_car = stand(position, heading, world_->terrain().height(position)) *
                                          Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX());
    for (const Face& face : car.faces) faces.push_back(moved(face, T_world_car));
  }
  return faces;
}

}  // namespace stereo_slam::simulate
