// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "simulator/world/world.hpp"

namespace stereo_slam::simulator {

/// Vehicles that drive along the route: every other one ahead of the camera in its lane, the rest towards it
/// in the other; half of them lorries.
///
/// One ahead keeps a distance that swells and shrinks slowly. The oncoming ones drive at the speed of their
/// lane and enter again far ahead once they have passed behind the camera; the more there are, the denser
/// they come, up to a jam of vehicles a few metres apart.
class Traffic {
 public:
  /// `path` is the camera's, one pose every 1/fps seconds.
  Traffic(const World& world, const CameraPath& path, double fps, int vehicles, std::uint64_t seed);

  /// Faces of all vehicles at a frame.
  [[nodiscard]] std::vector<Face> at(std::size_t frame) const;

 private:
  struct Vehicle {
    std::vector<Face> faces;  ///< standing at the origin
    bool oncoming = false;
    double distance_m = 20.0;  ///< ahead of the camera at the start, the least of one in its lane
    double phase_rad = 0.0;    ///< of the distance's swing
  };

  /// Distance driven where a vehicle is at a frame.
  [[nodiscard]] double arc_m(const Vehicle& vehicle, std::size_t frame) const;

  const World* world_;
  double fps_;
  std::vector<double> arcs_m_;  ///< distance driven by the camera at each frame
  double ahead_swing_m_;
  double oncoming_speed_m_s_;
  double oncoming_cycle_m_;  ///< length of the stretch around the camera that the oncoming ones fill
  std::vector<Vehicle> vehicles_;
};

}  // namespace stereo_slam::simulator
