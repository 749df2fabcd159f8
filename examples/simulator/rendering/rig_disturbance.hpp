// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "simulator/rendering/projection.hpp"

namespace stereo_slam::simulator {

/// How the right camera moves against the left one while a recording is made, and when it is exposed. The
/// displacements are those of distant points in the right image: in u as given; kAcrossShare of it in v, and
/// by a roll at the left and the right border.
struct RigDisturbance {
  double vibration_px = 0.0;  ///< normal, this standard deviation in u; [0, 20]
  /// Correlation time of the vibration (first-order autoregressive), in frames; 0: independent in each frame.
  double vibration_frames = 0.0;  ///< [0, 1e6]
  double drift_px = 0.0;          ///< linear, from 0 in the first frame to this in the last one; [-20, 20]
  double sync_error_s = 0.0;      ///< how much later than the left image the right one is exposed; [-1, 1]

  static constexpr double kAcrossShare = 0.3;

  [[nodiscard]] bool moves_camera() const { return vibration_px > 0.0 || drift_px != 0.0; }
  [[nodiscard]] bool any() const { return moves_camera() || sync_error_s != 0.0; }
};

/// What happens to the right camera in one frame.
struct RightCameraError {
  /// Rotation vector (pitch, yaw, roll) about the right camera's x, y and z: x_real = exp(rotation) x_ideal.
  Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();
  double delay_s = 0.0;  ///< of its exposure
};

/// Rotation matrix of a rotation vector.
[[nodiscard]] Eigen::Matrix3d rotation_matrix(const Eigen::Vector3d& rotation_rad);

/// Displacements to first order: of the principal point in u and in v, and of the left and the right border
/// in v by the roll.
[[nodiscard]] Eigen::Vector3d displacement_px(const PinholeCamera& camera,
                                              const Eigen::Vector3d& rotation_rad);

/// The errors of all frames; the same for the same seed.
[[nodiscard]] std::vector<RightCameraError> right_camera_errors(const RigDisturbance& disturbance,
                                                                const PinholeCamera& camera,
                                                                std::size_t frames, std::uint64_t seed);

}  // namespace stereo_slam::simulator
