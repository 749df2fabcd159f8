// SPDX-License-Identifier: MIT
#include "stereo_slam/results/pose_frame.hpp"

#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

class BodyFrame {
 public:
  explicit BodyFrame(const Eigen::Isometry3d& T_body_camera)
      : X_(to_pose(T_body_camera)), X_inverse_(X_.inverse()), Ad_(X_.adjoint()) {}

  [[nodiscard]] const Pose& X() const { return X_; }

  void transform(PoseGaussian& estimate) const {
    estimate.pose = X_ * estimate.pose * X_inverse_;
    estimate.covariance = covariance(estimate.covariance);
  }

  void transform(FrameResult& result) const {
    transform(result.T_world_camera);
    transform(result.odometry);
    result.T_odometry_camera = X_ * result.T_odometry_camera * X_inverse_;
    result.relative_covariance = covariance(result.relative_covariance);
  }

  void transform(LoopEvent& loop) const { loop.T_old_new = X_ * loop.T_old_new * X_inverse_; }

 private:
  [[nodiscard]] Matrix6<double> covariance(const Matrix6<double>& P) const {
    return Ad_ * P * Ad_.transpose();
  }

  Pose X_;
  Pose X_inverse_;
  Matrix6<double> Ad_;
};

}  // namespace

Eigen::Isometry3d require_body(const StereoSequence& sequence) {
  if (sequence.T_body_camera) return *sequence.T_body_camera;
  fail(sequence.folder,
       "its calibration has no T_BS (EuRoC) or T_body_left (your own camera); add it, or leave out "
       "--pose-frame body");
}

PoseGaussian in_body_frame(PoseGaussian pose, const Eigen::Isometry3d& T_body_camera) {
  BodyFrame(T_body_camera).transform(pose);
  return pose;
}

FrameResult in_body_frame(FrameResult result, const Eigen::Isometry3d& T_body_camera) {
  BodyFrame(T_body_camera).transform(result);
  return result;
}

LoopEvent in_body_frame(LoopEvent loop, const Eigen::Isometry3d& T_body_camera) {
  BodyFrame(T_body_camera).transform(loop);
  return loop;
}

RunRecord in_body_frame(RunRecord record, const Eigen::Isometry3d& T_body_camera) {
  const BodyFrame body(T_body_camera);
  for (auto& result : record.results) body.transform(result);
  for (auto& estimate : record.trajectory) body.transform(estimate);
  for (auto& loop : record.loops) body.transform(loop);
  for (auto& point : record.map_points) point.position_world = body.X() * point.position_world;
  return record;
}

}  // namespace stereo_slam
