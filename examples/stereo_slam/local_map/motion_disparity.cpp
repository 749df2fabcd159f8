// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/motion_disparity.hpp"

#include <Eigen/LU>

#include <antipode/geometry/quaternion.hpp>

namespace stereo_slam {
namespace {

/// Direction in which the camera sees a pixel, with depth 1.
[[nodiscard]] Vector3<double> ray_of(const Vector2<double>& px, const StereoCamera& camera) {
  return {(px.x() - camera.cx) / camera.fx, (px.y() - camera.cy) / camera.fy, 1.0};
}

/// d (u, v) / d h of the pixel (u, v) in which the camera sees the direction h.
[[nodiscard]] Eigen::Matrix<double, 2, 3> pixel_jacobian(const Vector3<double>& h,
                                                         const StereoCamera& camera) {
  const double inverse = 1.0 / h.z();
  Eigen::Matrix<double, 2, 3> J;
  J << camera.fx * inverse, 0.0, -camera.fx * h.x() * inverse * inverse,  //
      0.0, camera.fy * inverse, -camera.fy * h.y() * inverse * inverse;
  return J;
}

}  // namespace

std::optional<MotionDisparity> disparity_by_motion(const LeftPosition& first, const LeftPosition& second,
                                                   const PoseGaussian& T_first_second,
                                                   const StereoCamera& camera) {
  constexpr int kIterations = 3;
  constexpr double kLeastShift = 1e-3;  // of the first position by a disparity of 1 px, px: no parallax
  // The second camera sees the point at ray / w, with the inverse depth w; the first one at h = R ray + t w.
  const Matrix3<double> R = T_first_second.pose.rotation_matrix();
  const Vector3<double> t = T_first_second.pose.translation() / (camera.fx * camera.baseline_m);
  const Vector3<double> ray = ray_of(second.px, camera);
  const Vector3<double> turned = R * ray;
  // Starts where h has the direction of the first ray as nearly as possible.
  const Vector3<double> seen = ray_of(first.px, camera);
  const Vector3<double> line = t.cross(seen);
  if (line.isZero(0.0)) return std::nullopt;
  MotionDisparity result;
  result.px = -line.dot(turned.cross(seen)) / line.squaredNorm();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Vector3<double> h = turned + t * result.px;
    if (!(h.z() > 0.0)) return std::nullopt;
    const Eigen::Matrix<double, 2, 3> J_h = pixel_jacobian(h, camera);
    const Vector2<double> J = J_h * t;
    if (!(J.norm() > kLeastShift)) return std::nullopt;
    Eigen::Matrix<double, 3, 2> ray_by_px = Eigen::Matrix<double, 3, 2>::Zero();
    ray_by_px.diagonal() << 1.0 / camera.fx, 1.0 / camera.fy;
    const Matrix2<double> J_second = J_h * R * ray_by_px;
    const Matrix2<double> S = first.covariance_px2 + J_second * second.covariance_px2 * J_second.transpose();
    const Matrix2<double> W = S.inverse();
    const Vector2<double> e = first.px - Vector2<double>(camera.fx * h.x() / h.z() + camera.cx,
                                                         camera.fy * h.y() / h.z() + camera.cy);
    result.variance_px2 = 1.0 / J.dot(W * J);
    const Eigen::RowVector2d gain = result.variance_px2 * J.transpose() * W;
    Eigen::Matrix<double, 2, 6> J_motion;
    J_motion.leftCols<3>() = -J_h * R * antipode::skew(ray);
    J_motion.rightCols<3>() = J_h * R * (result.px / (camera.fx * camera.baseline_m));
    result.by_motion = -gain * J_motion;
    result.by_first = gain;
    result.by_second = -gain * J_second;
    const double step_px = gain.dot(e);
    const Vector2<double> rest = e - J * step_px;
    const Matrix2<double> S_motion = S + J_motion * T_first_second.covariance * J_motion.transpose();
    result.squared_distance = rest.dot(S_motion.inverse() * rest);
    result.px += step_px;
  }
  return result;
}

}  // namespace stereo_slam
