// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>

#include "simulator/world/camera_path.hpp"

namespace stereo_slam::simulator {

/// A body at one time of a PathSpline.
struct BodyMotion {
  Eigen::Isometry3d T_world_body = Eigen::Isometry3d::Identity();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< m/s, in the axes of the world
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();      ///< m/s^2, likewise
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< rad/s, in the axes of the body
};

/// A smooth motion through the poses of a path, with its derivatives in closed form, for inertial sensors.
///
/// Position and quaternion are natural cubic splines of time, the quaternion is divided by its length: the
/// motion meets every pose, and accelerations and angular velocities are continuous.
class PathSpline {
 public:
  /// Through the poses T_world_body of frames at the given rate. Throws std::invalid_argument for fewer than
  /// two.
  PathSpline(const CameraPath& path, double fps);

  /// The motion at a time since the first frame; before that frame and behind the last one it goes on with
  /// the first and the last cubic.
  [[nodiscard]] BodyMotion at(double time_s) const;
  /// The time of the last frame.
  [[nodiscard]] double duration_s() const;

 private:
  using Values = Eigen::Matrix<double, 7, Eigen::Dynamic>;  ///< position, quaternion (w, x, y, z)

  double step_s_;
  Values values_;              ///< at the frames
  Values second_derivatives_;  ///< there
};

}  // namespace stereo_slam::simulator
