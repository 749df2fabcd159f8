// SPDX-License-Identifier: MIT
#include "stereo_slam/report/trajectory_geometry.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>

namespace stereo_slam::report {

std::vector<double> path_lengths(std::span<const PoseGaussian> trajectory) {
  std::vector<double> lengths_m(trajectory.size(), 0.0);
  for (std::size_t k = 1; k < trajectory.size(); ++k) {
    lengths_m[k] =
        lengths_m[k - 1] + (trajectory[k].pose.translation() - trajectory[k - 1].pose.translation()).norm();
  }
  return lengths_m;
}

Matrix3<double> position_covariance(const PoseGaussian& T_world_camera) {
  const Matrix3<double> R = T_world_camera.pose.rotation_matrix();
  return R * T_world_camera.covariance.bottomRightCorner<3, 3>() * R.transpose();
}

SigmaEllipse sigma_ellipse(const PoseGaussian& T_world_camera) {
  const Matrix3<double> P = position_covariance(T_world_camera);
  Matrix2<double> in_plane;
  in_plane << P(0, 0), P(0, 2), P(2, 0), P(2, 2);
  const Eigen::SelfAdjointEigenSolver<Matrix2<double>> solver(in_plane);
  const Vector2<double> longer = solver.eigenvectors().col(1);
  return {solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().reverse(), std::atan2(longer.y(), longer.x())};
}

}  // namespace stereo_slam::report
