// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include <Eigen/Core>

#include <antipode/sensors/stereo_camera.hpp>

/// @file
/// The rectified stereo camera of the SLAM.
namespace stereo_slam {

/// Rectified pinhole stereo pair with the same focal lengths and a horizontal baseline (DQV-SLAM eq. 12).
///
///     z = (u, v, d) = (fx X/Z + cx,  fy Y/Z + cy,  fx b/Z),   d = u_left - u_right
///
/// Like antipode::StereoCamera, but with the size of the images and without points at infinity, for which
/// homogeneous() is. Valid for Z > kMinDepth_m. Points are in the axes of the left camera: x right, y down, z
/// forward, in m.
struct StereoCamera {
  double fx = 0.0;          ///< focal length, px
  double fy = 0.0;          ///< focal length, px
  double cx = 0.0;          ///< principal point of the left image, px
  double cy = 0.0;          ///< principal point of both images, px
  double baseline_m = 0.0;  ///< distance of the two cameras
  int width_px = 0;         ///< of either image
  int height_px = 0;        ///< of either image

  static constexpr double kMinDepth_m = 0.1;  ///< nearer points cannot be measured

  using Vector2 = Eigen::Vector2d;  ///< pixels
  using Vector3 = Eigen::Vector3d;  ///< points and measurements
  using Matrix3 = Eigen::Matrix3d;  ///< Jacobians and covariances

  /// The same camera for points that may be at infinity.
  [[nodiscard]] antipode::StereoCamera<double> homogeneous() const {
    return {fx, fy, cx, cy, baseline_m, kMinDepth_m};
  }

  /// (u, v, d) of a point in camera coordinates; nothing when it is not in front of the camera.
  [[nodiscard]] std::optional<Vector3> project(const Vector3& p) const {
    if (!(p.z() > kMinDepth_m)) return std::nullopt;
    return project_unchecked(p);
  }

  /// As project(), for points known to have Z > 0.
  [[nodiscard]] Vector3 project_unchecked(const Vector3& p) const {
    const double inverse_depth = 1.0 / p.z();
    return {fx * p.x() * inverse_depth + cx, fy * p.y() * inverse_depth + cy,
            fx * baseline_m * inverse_depth};
  }

  /// Point in camera coordinates of a measurement with positive disparity.
  [[nodiscard]] Vector3 back_project(const Vector3& z) const {
    const double depth = fx * baseline_m / z.z();
    return {(z.x() - cx) * depth / fx, (z.y() - cy) * depth / fy, depth};
  }

  /// d project / d p.
  [[nodiscard]] Matrix3 projection_jacobian(const Vector3& p) const {
    const double w = 1.0 / p.z();
    Matrix3 J;
    J << fx * w, 0.0, -fx * p.x() * w * w,  //
        0.0, fy * w, -fy * p.y() * w * w,   //
        0.0, 0.0, -fx * baseline_m * w * w;
    return J;
  }

  /// d back_project / d z.
  [[nodiscard]] Matrix3 back_projection_jacobian(const Vector3& z) const {
    return projection_jacobian(back_project(z)).inverse();
  }

  /// Whether (u, v) lies in the left image and u - d in the right one, `border_px` away from the edges.
  [[nodiscard]] bool in_view(const Vector3& z, double border_px = 0.0) const {
    const double right_u = z.x() - z.z();
    return z.x() >= border_px && z.x() < width_px - border_px && z.y() >= border_px &&
           z.y() < height_px - border_px && right_u >= border_px && right_u < width_px - border_px;
  }
};

using antipode::stereo_pixel_covariance;

}  // namespace stereo_slam
