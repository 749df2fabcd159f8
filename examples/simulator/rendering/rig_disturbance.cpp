// SPDX-License-Identifier: MIT
#include "simulator/rendering/rig_disturbance.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "simulator/textures/random.hpp"

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

/// Displacement by one radian about each axis: yaw moves points to the right, pitch upwards.
[[nodiscard]] Vector3d pixels_per_radian(const PinholeCamera& camera) {
  return {-camera.fy, camera.fx, 0.5 * camera.width_px};
}

/// Rotation that displaces by `displacement_px` in u.
[[nodiscard]] Vector3d unit_rotation(const PinholeCamera& camera) {
  constexpr double kAcross = RigDisturbance::kAcrossShare;
  return Vector3d(kAcross, 1.0, kAcross).cwiseQuotient(pixels_per_radian(camera));
}

}  // namespace

Eigen::Matrix3d rotation_matrix(const Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  if (!(angle > 0.0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rotation_rad / angle).toRotationMatrix();
}

Vector3d displacement_px(const PinholeCamera& camera, const Vector3d& rotation_rad) {
  const Vector3d moved = rotation_rad.cwiseProduct(pixels_per_radian(camera));
  return {moved.y(), moved.x(), moved.z()};
}

std::vector<RightCameraError> right_camera_errors(const RigDisturbance& disturbance,
                                                  const PinholeCamera& camera, std::size_t frames,
                                                  std::uint64_t seed) {
  constexpr std::uint64_t kStream = 78;
  Random random(seed, kStream);
  const Vector3d unit = unit_rotation(camera);
  const double memory =
      disturbance.vibration_frames > 0.0 ? std::exp(-1.0 / disturbance.vibration_frames) : 0.0;
  const double fresh = std::sqrt(1.0 - memory * memory);
  const double steps = static_cast<double>(std::max<std::size_t>(frames, 2) - 1);
  std::vector<RightCameraError> errors(frames);
  Vector3d state;  // of the vibration; stationary with unit variance from the first frame on
  for (std::size_t i = 0; i < frames; ++i) {
    Vector3d draw;
    for (double& value : draw) value = random.normal();
    state = i == 0 ? draw : Vector3d(memory * state + fresh * draw);
    const double drift_px = disturbance.drift_px * (static_cast<double>(i) / steps);
    errors[i].rotation_rad =
        unit.cwiseProduct(disturbance.vibration_px * state + Vector3d::Constant(drift_px));
    errors[i].delay_s = disturbance.sync_error_s;
  }
  return errors;
}

}  // namespace stereo_slam::simulator
