// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "simulator/world/world.hpp"

namespace stereo_slam::simulator {

/// Vehicles that drive along the route. Every second one drives ahead of the camera in the camera's lane; the
/// others are oncoming, in the other lane. Half of the vehicles are lorries, the rest cars.
///
/// The distance of a vehicle ahead to the camera varies slowly. All oncoming vehicles have one speed; a
/// vehicle that has passed the camera enters again far ahead. The more oncoming vehicles there are, the
/// smaller the distances between them, down to a jam of vehicles a few metres apart.
class Traffic {
 public:
  /// `path` is the camera's, one pose every 1/fps seconds.
  Traffic(const World& world, const CameraPath& path, double fps, int vehicles, std::uint64_t seed);

  /// Faces of all vehicles `later` frames after a frame.
  [[nodiscard]] std::vector<Face> at(std::size_t frame, double later = 0.0) const;

 private:
  struct Vehicle {
    std::vector<Face> faces;  ///< standing at the origin
    bool oncoming = false;
    /// Distance ahead of the camera: of an oncoming vehicle, at the start; of one in its lane, the smallest.
    double distance_m = 20.0;
    double phase_rad = 0.0;  ///< of the variation of the distance
  };

  /// Distance driven by the camera.
  [[nodiscard]] double camera_arc_m(std::size_t frame, double later) const;
  /// Position of a vehicle, as distance along the route.
  [[nodiscard]] double arc_m(const Vehicle& vehicle, std::size_t frame, double later) const;

  const World* world_;
  double fps_;
  std::vector<double> arcs_m_;  ///< distance driven by the camera at each frame
  double ahead_swing_m_;
  double oncoming_speed_m_s_;
  double oncoming_cycle_m_;  ///< length of the part of the route around the camera with oncoming vehicles
  std::vector<Vehicle> vehicles_;
};

}  // namespace stereo_slam::simulator
