// SPDX-License-Identifier: MIT
#include "stereo_slam/results/pose_frame.hpp"

#include <stdexcept>

#include <fmt/format.h>

namespace stereo_slam {

Eigen::Isometry3d require_body(const StereoSequence& sequence) {
  if (sequence.T_body_camera) return *sequence.T_body_camera;
  throw std::runtime_error(fmt::format(
      "{}: its calibration has no T_BS (EuRoC) or T_body_left (your own camera); add it, or leave out "
      "--pose-frame body",
      sequence.folder.string()));
}

RunRecord in_body_frame(RunRecord record, const Eigen::Isometry3d& T_body_camera) {
  const Pose X = Pose::from_matrix(Eigen::Quaterniond(T_body_camera.linear()).normalized().toRotationMatrix(),
                                   T_body_camera.translation());
  const Pose X_inverse = X.inverse();
  const Matrix6<double> Ad = X.adjoint();
  const auto covariance = [&](const Matrix6<double>& P) { return Matrix6<double>(Ad * P * Ad.transpose()); };
  const auto transform = [&](PoseGaussian& estimate) {
    estimate.pose = X * estimate.pose * X_inverse;
    estimate.covariance = covariance(estimate.covariance);
  };
  for (auto& result : record.results) {
    transform(result.T_world_camera);
    transform(result.odometry);
    result.T_odometry_camera = X * result.T_odometry_camera * X_inverse;
    result.relative_covariance = covariance(result.relative_covariance);
  }
  for (auto& estimate : record.trajectory) transform(estimate);
  for (auto& loop : record.loops) loop.T_old_new = X * loop.T_old_new * X_inverse;
  for (auto& point : record.map_points) point.position_world = X * point.position_world;
  return record;
}

}  // namespace stereo_slam
