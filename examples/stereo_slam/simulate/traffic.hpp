// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "world.hpp"

namespace stereo_slam::simulate {

/// Cars that drive along the route: every other one ahead of the camera in its lane, the rest towards it in
/// the other.
///
/// A car ahead keeps a distance that swells and shrinks slowly. An oncoming one drives at its own speed and
/// enters again far ahead once it has passed behind the camera.
class Traffic {
 public:
  /// `path` is the camera's, one pose every 1/fps seconds.
  Traffic(const World& world, const CameraPath& path, double fps, int cars, std::uint64_t seed);

  /// Faces of all cars at a frame.
  [[nodiscard]] std::vector<Face> at(std::size_t frame) const;

 private:
  struct Car {
    std::vector<Face> faces;  ///< standing at the origin
    bool oncoming = false;
    double distance_m = 20.0;
    double speed_m_s = 8.0;  ///< of an oncoming car
    double phase_rad = 0.0;
  };

  const World* world_;
  double fps_;
  std::vector<double> arcs_m_;  ///< distance driven by the camera at each frame
  std::vector<Car> cars_;
};

}  // namespace stereo_slam::simulate
