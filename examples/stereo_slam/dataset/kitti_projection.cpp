// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/kitti_projection.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {

Eigen::Vector3d KittiProjection::position_of_camera_0_m() const {
  if (P.col(3).isZero(0.0)) return Eigen::Vector3d::Zero();
  return P.leftCols<3>().inverse() * P.col(3);
}

StereoCamera camera_of(const KittiProjection& left, const KittiProjection& right,
                       const std::filesystem::path& file) {
  const auto& [left_name, P_left] = left;
  const auto& [right_name, P_right] = right;
  const double fx = P_left(0, 0);
  const double fy = P_left(1, 1);
  if (!(fx > 0.0 && fy > 0.0))
    fail(file, "{} has focal lengths {} and {}; both must be positive", left_name, fx, fy);
  const double tolerance_px = 1e-6 * fx;
  Eigen::Matrix3d pinhole;
  pinhole << fx, 0.0, P_left(0, 2), 0.0, fy, P_left(1, 2), 0.0, 0.0, 1.0;
  if (!P_left.leftCols<3>().isApprox(pinhole, 1e-6)) {
    fail(file, "{} is not [fx 0 cx tx; 0 fy cy ty; 0 0 1 tz]; rectified images are needed", left_name);
  }
  if (!((P_right.leftCols<3>() - P_left.leftCols<3>()).cwiseAbs().maxCoeff() <= tolerance_px)) {
    fail(file,
         "{} and {} have different intrinsics; rectified images with one common camera matrix are needed",
         left_name, right_name);
  }
  const Eigen::Vector3d shift = P_right.col(3) - P_left.col(3);  // px m, px m, m
  const double baseline_m = -shift.x() / fx;
  if (std::abs(baseline_m) < 1e-6) {
    fail(file, "{} gives a baseline of zero; its fourth number must be -fx times the baseline in metres",
         right_name);
  }
  if (baseline_m < 0.0) {
    fail(file,
         "{1} gives a baseline of {2:.6g} m, the right camera left of the left one; {0} and {1} or the two "
         "cameras are swapped, or the fourth number of {1} lost its minus sign",
         left_name, right_name, baseline_m);
  }
  constexpr double kMostAcross = 0.01;  // of the baseline
  if (std::max(std::abs(shift.y()) / fy, std::abs(shift.z())) > kMostAcross * baseline_m) {
    fail(file,
         "{} has the fourth column ({:.6g}, {:.6g}, {:.6g}), but its second and third numbers must be {}: "
         "rectified cameras lie side by side; take the calib.txt of the sequence",
         right_name, P_right(0, 3), P_right(1, 3), P_right(2, 3),
         P_left(1, 3) == 0.0 && P_left(2, 3) == 0.0 ? "0" : "those of " + left_name);
  }
  return {.fx = fx, .fy = fy, .cx = P_left(0, 2), .cy = P_left(1, 2), .baseline_m = baseline_m};
}

}  // namespace stereo_slam
