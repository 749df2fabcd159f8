// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "simulator/world/camera_path.hpp"

namespace stereo_slam::simulator {

/// Point on the ground, (x, z) of the world.
using GroundPoint = Eigen::Vector2d;

/// Rectangle on the ground.
struct GroundBox {
  GroundPoint centre = GroundPoint::Zero();
  GroundPoint along = GroundPoint::UnitX();  ///< unit direction of the length
  double half_length_m = 0.5;
  double half_width_m = 0.5;

  [[nodiscard]] GroundPoint across() const { return {-along.y(), along.x()}; }
  /// Distance of a point to the rectangle, 0 inside.
  [[nodiscard]] double distance(const GroundPoint& point) const;
  /// Whether two rectangles share a point (separating axes).
  [[nodiscard]] bool overlaps(const GroundBox& other) const;
};

/// The street along the camera path: stations a metre apart, continued straight beyond both ends, with fast
/// look-up of nearby stations.
class Route {
 public:
  struct Station {
    GroundPoint position;
    GroundPoint direction;   ///< unit
    double ground_y = 0.0;   ///< world y of the ground below the camera
    double arc_m = 0.0;      ///< distance driven; negative before the path begins
    bool first_pass = true;  ///< false where an earlier part of the path passes the same place
  };

  /// Throws std::invalid_argument for an empty path. `run_out_m` is how far the street goes on, straight, at
  /// either end.
  Route(const CameraPath& path, double camera_height_m, double run_out_m = kRunOut_m);

  [[nodiscard]] const std::vector<Station>& stations() const noexcept { return stations_; }

  /// Distance to the nearest station, or `limit_m` when none is nearer.
  [[nodiscard]] double distance(const GroundPoint& point, double limit_m) const;

  /// Whether the rectangle stays `clearance_m` away from the route.
  [[nodiscard]] bool is_clear(const GroundBox& box, double clearance_m) const;

  /// Position, direction and height at a distance driven; straight on beyond the ends.
  [[nodiscard]] Station at_arc(double arc_m) const;

  [[nodiscard]] const GroundPoint& low() const noexcept { return low_; }  ///< bounding box
  [[nodiscard]] const GroundPoint& high() const noexcept { return high_; }

  /// Length of the continuation at the ends, where it meets no other part of the street.
  [[nodiscard]] double run_out_m() const noexcept { return run_out_m_; }

  static constexpr double kSpacing_m = 1.0;
  static constexpr double kRunOut_m = 70.0;

 private:
  /// Fills cells_, the bounding box and first_pass.
  void index_stations();
  /// Where the path passes a place several times at different heights, sets the ground to that of the lowest
  /// pass.
  void lower_to_lowest_pass();
  /// Calls visit(station) for the stations that may be within `radius_m` of the point.
  template <class Visit>
  void for_near(const GroundPoint& point, double radius_m, Visit visit) const;

  double run_out_m_;
  std::vector<Station> stations_;
  std::unordered_map<long long, std::vector<std::size_t>> cells_;  ///< stations by square of the ground
  GroundPoint low_ = GroundPoint::Zero();
  GroundPoint high_ = GroundPoint::Zero();
};

}  // namespace stereo_slam::simulator
