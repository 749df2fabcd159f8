// SPDX-License-Identifier: MIT
#include "stereo_slam/report/trajectory_geometry.hpp"

#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace stereo_slam::report {

std::vector<double> path_lengths(std::span<const PoseGaussian> trajectory) {
  std::vector<double> lengths_m(trajectory.size(), 0.0);
  for (std::size_t k = 1; k < trajectory.size(); ++k) {
    lengths_m[k] =
        lengths_m[k - 1] + (trajectory[k].pose.translation() - trajectory[k - 1].pose.translation()).norm();
  }
  return lengths_m;
}

std::vector<double> speeds(std::span<const PoseGaussian> trajectory,
                           std::span<const std::int64_t> stamps_ns) {
  std::vector<double> speeds_mps(trajectory.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t k = 1; k < trajectory.size(); ++k) {
    const double seconds = 1e-9 * static_cast<double>(stamps_ns[k] - stamps_ns[k - 1]);
    const double step_m = (trajectory[k].pose.translation() - trajectory[k - 1].pose.translation()).norm();
    if (seconds > 0.0) speeds_mps[k] = step_m / seconds;
  }
  if (speeds_mps.size() > 1) speeds_mps[0] = speeds_mps[1];
  return speeds_mps;
}

Matrix3<double> position_covariance(const PoseGaussian& T_world_camera) {
  const Matrix3<double> R = T_world_camera.pose.rotation_matrix();
  return R * T_world_camera.covariance.bottomRightCorner<3, 3>() * R.transpose();
}

SigmaEllipsoid sigma_ellipsoid(const PoseGaussian& T_world_camera) {
  const Eigen::SelfAdjointEigenSolver<Matrix3<double>> solver(position_covariance(T_world_camera));
  Matrix3<double> R = solver.eigenvectors();
  if (R.determinant() < 0.0) R.col(0) *= -1.0;
  return {solver.eigenvalues().cwiseMax(0.0).cwiseSqrt(), Eigen::Quaterniond(R)};
}

}  // namespace stereo_slam::report
