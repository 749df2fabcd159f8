// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

/// @file
/// Raw stereo cameras, before rectification.
namespace stereo_slam {

/// Lens distortion of the ray (x, y) = (X/Z, Y/Z), r^2 = x^2 + y^2.
enum class Distortion {
  kNone,  ///< a pinhole camera
  /// Radial and tangential, k1 k2 p1 p2 [k3 [k4 k5 k6]] (OpenCV's order):
  ///
  ///     s = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
  ///     x' = s x + 2 p1 x y + p2 (r^2 + 2 x^2),  y' = s y + p1 (r^2 + 2 y^2) + 2 p2 x y
  kRadTan,
  /// Fisheye, k1 k2 k3 k4, with theta = atan r (Kannala and Brandt, PAMI 2006):
  ///
  ///     (x', y') = (x, y) / r * theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)
  kEquidistant,
};

/// A raw camera, before rectification: u = fx x' + cx, v = fy y' + cy.
struct Lens {
  int width_px = 0;                           ///< of its images
  int height_px = 0;                          ///< of its images
  double fx = 0.0;                            ///< focal length, px
  double fy = 0.0;                            ///< focal length, px
  double cx = 0.0;                            ///< principal point, px
  double cy = 0.0;                            ///< principal point, px
  Distortion distortion = Distortion::kNone;  ///< the model that the coefficients belong to
  std::vector<double> coefficients;           ///< of the model
};

/// Two raw cameras and their relative pose.
struct StereoRig {
  Lens left;                                                       ///< the camera that poses refer to
  Lens right;                                                      ///< the camera on its right
  Eigen::Isometry3d T_right_left = Eigen::Isometry3d::Identity();  ///< maps left to right coordinates, m
  std::optional<Eigen::Isometry3d> T_body_left;                    ///< EuRoC's T_BS of the left camera
  std::optional<std::int64_t> imu_later_ns{};  ///< Kalibr's timeshift_cam_imu: by how much the stamps of the
                                               ///< IMU are later than those of the left camera
};

}  // namespace stereo_slam
