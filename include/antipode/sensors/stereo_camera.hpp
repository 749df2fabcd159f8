// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <optional>

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/jacobians.hpp>
#include <antipode/geometry/quaternion.hpp>

/// @file
/// The measurement of a rectified stereo camera, with Jacobians.
namespace antipode {

/// The point x / w; with w = 0, the point at infinity in the direction x.
template <std::floating_point Scalar>
struct HomogeneousPoint {
  Vector3<Scalar> x;     ///< w times the point, m, or a direction
  Scalar w = Scalar(1);  ///< 0 at infinity
};

/// The Jacobians of a projection z = (u, v, d) [px].
template <std::floating_point Scalar>
struct ProjectionJacobians {
  Matrix<Scalar, 3, 6> pose;   ///< dz / d xi for T_reference_camera exp(xi), rotation first
  Matrix<Scalar, 3, 4> point;  ///< dz / d (x, w)
};

/// A rectified stereo pair with a horizontal baseline (DQV-SLAM Eq. 12):
///
///     z = (u, v, d) = (fx X/Z + cx,  fy Y/Z + cy,  fx b/Z),   d = u_left - u_right   [px]
///
/// of a point (X, Y, Z) [m] in the axes of the left camera: x right, y down, z forward. Plain data; check()
/// validates it.
template <std::floating_point Scalar_>
struct StereoCamera {
  using Scalar = Scalar_;  ///< of all numbers

  Scalar fx = 0,                     ///< focal length along u, px
      fy = 0;                        ///< focal length along v, px
  Scalar cx = 0,                     ///< principal point of the left image, px
      cy = 0;                        ///< principal point of both images, px
  Scalar baseline_m = 0;             ///< distance of the two cameras
  Scalar min_depth_m = Scalar(0.1);  ///< nearer points cannot be measured

  /// Throws unless focal lengths and baseline are positive and finite, the principal point is finite and the
  /// least depth is finite and not negative.
  void check() const {
    const Vector3<Scalar> lengths(fx, fy, baseline_m);
    if (!(lengths.minCoeff() > Scalar(0)) || !lengths.allFinite()) [[unlikely]] {
      detail::throw_invalid("focal lengths or baseline of a stereo camera are not positive and finite",
                            lengths);
    }
    detail::require_finite("principal point of a stereo camera is not finite", Vector2<Scalar>(cx, cy));
    if (!(min_depth_m >= Scalar(0) && std::isfinite(min_depth_m))) [[unlikely]] {
      detail::throw_invalid("least depth of a stereo camera is negative or not finite", min_depth_m);
    }
  }

  /// (u, v, d) of a point in camera coordinates; nothing unless its depth is above min_depth_m.
  [[nodiscard]] std::optional<Vector3<Scalar>> project(const Vector3<Scalar>& p_camera) const {
    return project_in_camera({p_camera, Scalar(1)});
  }

  /// (u, v, d) of a point of the reference frame, which may be at infinity, from a camera pose. Nothing if
  /// the point is behind the camera or nearer than min_depth_m. With w < 0, as back_project() returns for a
  /// negative disparity, d is negative.
  [[nodiscard]] std::optional<Vector3<Scalar>> project(const DualQuaternion<Scalar>& T_reference_camera,
                                                       const HomogeneousPoint<Scalar>& point) const {
    return project_in_camera(in_camera(T_reference_camera, point));
  }

  /// d project / d (pose, point), for a point that can be measured (not checked).
  [[nodiscard]] ProjectionJacobians<Scalar> projection_jacobians(
      const DualQuaternion<Scalar>& T_reference_camera, const HomogeneousPoint<Scalar>& point) const {
    const auto [h, w] = in_camera(T_reference_camera, point);
    const Scalar inverse = Scalar(1) / h[2];
    Matrix3<Scalar> J_h;                                             // dz / d (point in camera coordinates)
    J_h << fx * inverse, Scalar(0), -fx * h[0] * inverse * inverse,  //
        Scalar(0), fy * inverse, -fy * h[1] * inverse * inverse,     //
        Scalar(0), Scalar(0), -fx * baseline_m * w * inverse * inverse;
    ProjectionJacobians<Scalar> J;
    J.pose << J_h * skew(h), -w * J_h;
    const Matrix3<Scalar> R = T_reference_camera.rotation_matrix();
    const Vector3<Scalar> t_camera = R.transpose() * T_reference_camera.translation();
    const Matrix3<Scalar> by_x = J_h * R.transpose();
    Vector3<Scalar> by_w = -(J_h * t_camera);
    by_w[2] += fx * baseline_m * inverse;
    J.point << by_x, by_w;
    return J;
  }

  /// The point in camera coordinates that is measured as z = (u, v, d) [px]; at infinity for d = 0.
  [[nodiscard]] HomogeneousPoint<Scalar> back_project(const Vector3<Scalar>& z) const {
    return {Vector3<Scalar>((z[0] - cx) / fx, (z[1] - cy) / fy, Scalar(1)), z[2] / (fx * baseline_m)};
  }

 private:
  [[nodiscard]] static HomogeneousPoint<Scalar> in_camera(const DualQuaternion<Scalar>& T_reference_camera,
                                                          const HomogeneousPoint<Scalar>& point) {
    const Vector3<Scalar> from_camera = point.x - T_reference_camera.translation() * point.w;
    return {rotate(conjugate(T_reference_camera.rotation()), from_camera), point.w};
  }
  [[nodiscard]] std::optional<Vector3<Scalar>> project_in_camera(const HomogeneousPoint<Scalar>& p) const {
    const auto& [h, w] = p;
    if (!(h[2] > min_depth_m * w) || !(h[2] > Scalar(0))) return std::nullopt;
    return Vector3<Scalar>(fx * h[0] / h[2] + cx, fy * h[1] / h[2] + cy, fx * baseline_m * w / h[2]);
  }
};

/// The covariance of (u, v, d) if u_left, u_right and v have independent errors of sigma_px each: the
/// disparity has twice the variance and is correlated with u.
template <std::floating_point Scalar>
[[nodiscard]] Matrix3<Scalar> stereo_pixel_covariance(Scalar sigma_px) {
  Matrix3<Scalar> R;
  R << Scalar(1), Scalar(0), Scalar(1),  //
      Scalar(0), Scalar(1), Scalar(0),   //
      Scalar(1), Scalar(0), Scalar(2);
  return sigma_px * sigma_px * R;
}

}  // namespace antipode
