// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <optional>

#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/sensors/stereo_camera.hpp>

/// @file
/// A landmark in inverse depth (DQV-SLAM Eq. 10).
namespace antipode {

/// A landmark, given by the measurement z = (u, v, d) [px] of the stereo camera that saw it first, at the
/// pose T_reference_anchor.
///
/// Its depth in that camera is fx b / d. In these coordinates the noise of a triangulation is Gaussian at any
/// distance, and points at infinity have d = 0; in X, Y, Z it is not Gaussian beyond some forty baselines.
/// The covariance is that of the pixels, stereo_pixel_covariance(sigma) say, and shrinks as the landmark is
/// seen again (unscented_update with project()). Source: DQV-SLAM Eq. 10; J. Civera, A. Davison, J. Montiel,
/// "Inverse depth parametrization for monocular SLAM", 2008.
template <std::floating_point Scalar>
struct InverseDepthLandmark {
  DualQuaternion<Scalar> T_reference_anchor;  ///< pose of the left camera that saw it first
  Vector3<Scalar> mean;                       ///< (u, v, d), px
  Matrix3<Scalar> covariance;                 ///< px^2

  /// The point in the reference frame for parameters (u, v, d) [px]: the mean, or a sample.
  [[nodiscard]] HomogeneousPoint<Scalar> point(const StereoCamera<Scalar>& camera,
                                               const Vector3<Scalar>& uvd) const {
    const auto [ray, w] = camera.back_project(uvd);
    return {T_reference_anchor.rotation_matrix() * ray + T_reference_anchor.translation() * w, w};
  }

  /// d point / d (u, v, d), 4 x 3 with the rows (x, w). It does not depend on the parameters.
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

  /// The measurement (u, v, d) [px] from a camera pose of the landmark with parameters `uvd`; nothing if the
  /// camera cannot measure it. This is the model h(pose, landmark) of project_gaussian and unscented_update.
  [[nodiscard]] std::optional<Vector3<Scalar>> project(const StereoCamera<Scalar>& camera,
                                                       const DualQuaternion<Scalar>& T_reference_camera,
                                                       const Vector3<Scalar>& uvd) const {
    return camera.project(T_reference_camera, point(camera, uvd));
  }

  /// Mean and covariance (without pixel noise) of the measurement from a known camera pose, linearised in the
  /// landmark. Nothing if the camera cannot measure it. Throws unless the covariance is finite and symmetric.
  [[nodiscard]] std::optional<InverseDepthLandmark> seen_from(
      const StereoCamera<Scalar>& camera, const DualQuaternion<Scalar>& T_reference_camera) const {
    const HomogeneousPoint<Scalar> p = point(camera, mean);
    const auto z = camera.project(T_reference_camera, p);
    if (!z) return std::nullopt;
    const Matrix3<Scalar> J =
        camera.projection_jacobians(T_reference_camera, p).point * point_jacobian(camera);
    return InverseDepthLandmark{
        T_reference_camera, *z,
        detail::congruence<Scalar, 3, 3>(
            J, detail::checked_symmetric<Scalar, 3>("covariance of a landmark is not finite or not symmetric",
                                                    covariance))};
  }
};

}  // namespace antipode
