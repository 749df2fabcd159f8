// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <optional>

#include <antipode/detail/products.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/sensors/stereo_camera.hpp>

/// @file
/// A landmark in inverse depth (DQV-SLAM Eq. 10).
namespace antipode {

/// A landmark by what the stereo camera measured that saw it first: z = (u, v, d) [px] at the pose
/// T_reference_anchor.
///
/// In these coordinates (inverse depth, but for a factor) the noise of a triangulation is Gaussian at any
/// distance, and points at infinity are d = 0; in X, Y, Z it is not, from some forty baselines on. The
/// covariance is that of the pixels, stereo_pixel_covariance(sigma) say, and shrinks as the landmark is seen
/// again (unscented_update with project()). Source: DQV-SLAM Eq. 10; J. Civera, A. Davison, J. Montiel,
/// "Inverse depth parametrization for monocular SLAM", 2008.
template <std::floating_point Scalar>
struct InverseDepthLandmark {
  DualQuaternion<Scalar> T_reference_anchor;  ///< pose of the left camera that saw it first
  Vector3<Scalar> mean;                       ///< (u, v, d), px
  Matrix3<Scalar> covariance;                 ///< px^2

  /// The point of the reference frame for parameters (u, v, d): the mean, or a sample.
  [[nodiscard]] HomogeneousPoint<Scalar> point(const StereoCamera<Scalar>& camera,
                                               const Vector3<Scalar>& uvd) const {
    const auto [ray, w] = camera.back_project(uvd);
    return {T_reference_anchor.rotation_matrix() * ray + T_reference_anchor.translation() * w, w};
  }

  /// d point / d (u, v, d): rows of x and w. It does not depend on the parameters.
  [[nodiscard]] Matrix<Scalar, 4, 3> point_jacobian(const StereoCamera<Scalar>& camera) const {
    const Matrix3<Scalar> R = T_reference_anchor.rotation_matrix();
    const Scalar depth_scale = Scalar(1) / (camera.fx * camera.baseline_m);
    Matrix<Scalar, 4, 3> J = Matrix<Scalar, 4, 3>::Zero();
    J.col(0).template head<3>() = R.col(0) / camera.fx;
    J.col(1).template head<3>() = R.col(1) / camera.fy;
    J.col(2).template head<3>() = T_reference_anchor.translation() * depth_scale;
    J(3, 2) = depth_scale;
    return J;
  }

  /// The measurement of the landmark with parameters (u, v, d) from a camera pose: the model h(pose,
  /// landmark) of project_gaussian and unscented_update.
  [[nodiscard]] std::optional<Vector3<Scalar>> project(const StereoCamera<Scalar>& camera,
                                                       const DualQuaternion<Scalar>& T_reference_camera,
                                                       const Vector3<Scalar>& uvd) const {
    return camera.project(T_reference_camera, point(camera, uvd));
  }

  /// Mean and covariance (without pixel noise) of the measurement from a known pose, linearised in the
  /// landmark. Nothing where it cannot be measured.
  [[nodiscard]] std::optional<InverseDepthLandmark> seen_from(
      const StereoCamera<Scalar>& camera, const DualQuaternion<Scalar>& T_reference_camera) const {
    const HomogeneousPoint<Scalar> p = point(camera, mean);
    const auto z = camera.project(T_reference_camera, p);
    if (!z) return std::nullopt;
    const Matrix3<Scalar> J =
        camera.projection_jacobians(T_reference_camera, p).point * point_jacobian(camera);
    return InverseDepthLandmark{T_reference_camera, *z, detail::congruence<Scalar, 3, 3>(J, covariance)};
  }
};

}  // namespace antipode
