// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/plane_warp.hpp"

#include <cmath>

#include <Eigen/LU>

namespace stereo_slam {
namespace {

constexpr double kMinArea = 0.05;  // px^2, of a pixel in the other view: below, the plane is seen edge-on

}  // namespace

std::optional<PatchWarp> right_warp(const StereoPlane& plane, const LateExposure& exposure) {
  PatchWarp warp;
  if (exposure.is_late()) {
    const Matrix2<double> forward = exposure.warp(plane.z.head<2>(), plane.z.z(), plane.disparity_slope);
    if (!(forward.determinant() > kMinArea)) return std::nullopt;
    warp.linear = forward.inverse();
    return warp;
  }
  // The pixel at the offset (x, y) in the left image is at (x - slope . (x, y), y) in the right one.
  const double width = 1.0 - plane.disparity_slope.x();
  if (!(width > kMinArea)) return std::nullopt;
  warp.linear << 1.0 / width, plane.disparity_slope.y() / width, 0.0, 1.0;
  return warp;
}

std::optional<PlaneView> view_plane(const StereoPlane& plane, const Pose& T_first_second,
                                    const StereoCamera& camera) {
  // A pixel (u, v) with the disparity d is the point m = R ((u - cx) / fx, (v - cy) / fy, 1) + t d / (fx b)
  // of the second camera, divided by its depth in the first camera. With d linear in the pixel, m is linear
  // in the pixel too, so the views are related by a homography.
  const StereoPoint& z = plane.z;
  const Pose T_second_first = T_first_second.inverse();
  const Matrix3<double> R = T_second_first.rotation_matrix();
  const Vector3<double> t = T_second_first.translation() / (camera.fx * camera.baseline_m);
  const Vector3<double> m =
      R * Vector3<double>((z.x() - camera.cx) / camera.fx, (z.y() - camera.cy) / camera.fy, 1.0) + t * z.z();
  const double first_depth_m = camera.fx * camera.baseline_m / z.z();
  if (!(z.z() > 0.0 && m.z() * first_depth_m > StereoCamera::kMinDepth_m)) return std::nullopt;
  Eigen::Matrix<double, 3, 2> dm;  // d m / d (u, v)
  dm << R.col(0) / camera.fx + t * plane.disparity_slope.x(),
      R.col(1) / camera.fy + t * plane.disparity_slope.y();

  const Vector2<double> ray = m.head<2>() / m.z();
  const Vector2<double> perspective = dm.row(2).transpose() / m.z();
  Matrix2<double> forward = dm.topRows<2>() / m.z() - ray * perspective.transpose();
  forward.row(0) *= camera.fx;
  forward.row(1) *= camera.fy;
  if (!(std::abs(forward.determinant()) > kMinArea)) return std::nullopt;

  PlaneView view;
  view.left = {forward.inverse(), perspective};
  view.plane.z = {camera.fx * ray.x() + camera.cx, camera.fy * ray.y() + camera.cy, z.z() / m.z()};
  view.plane.disparity_slope =
      view.left.linear.transpose() * (plane.disparity_slope - z.z() * perspective) / m.z();
  const auto right = right_warp(view.plane);
  if (!right) return std::nullopt;
  view.right = {view.left.linear * right->linear, perspective};
  return view;
}

}  // namespace stereo_slam
