// SPDX-License-Identifier: MIT
#pragma once

#include <unordered_map>
#include <vector>

#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/predict.hpp>
#include <antipode/filters/unscented_update.hpp>

#include "drive.hpp"
#include "gauss_newton.hpp"

namespace consistency {

using antipode::predict_closed_form;

[[nodiscard]] inline PoseGaussian<double> certain() {
  return {Pose::identity(), 1e-12 * Matrix6<double>::Identity()};
}

/// State and covariance of T_world_camera by odometry alone.
class OdometryOnly {
 public:
  PoseGaussian<double> process(const DriveFrame& frame, const Drive&) {
    if (started_) {
      state_ = predict_closed_form<double>(state_, frame.T_previous_this,
                                           {Pose::identity(), Drive::odometry_covariance()});
    }
    started_ = true;
    return state_;
  }

 private:
  bool started_ = false;
  PoseGaussian<double> state_ = certain();
};

struct PointEstimate {
  Vector3<double> mean;
  Matrix3<double> covariance;
};

/// The points that both the map and the frame know.
[[nodiscard]] inline std::vector<PointMeasurement> known_points(
    const std::unordered_map<std::size_t, PointEstimate>& map, const DriveFrame& frame,
    const Pose& T_map_camera, const StereoCamera& camera) {
  std::vector<PointMeasurement> result;
  for (const auto& o : frame.observations) {
    const auto entry = map.find(o.point);
    if (entry == map.end()) continue;
    const auto& [mean, covariance] = entry->second;
    const Vector3<double> p = T_map_camera.inverse() * mean;
    if (p.z() < 1.0) continue;
    const Matrix3<double> J = camera.projection_jacobian(p) * T_map_camera.rotation_matrix().transpose();
    result.push_back({mean, o.z, J * covariance * J.transpose() + Drive::pixel_covariance()});
  }
  return result;
}

[[nodiscard]] inline PoseGaussian<double> update_pose(const PoseGaussian<double>& prior,
                                                      const std::vector<PointMeasurement>& measurements,
                                                      const StereoCamera& camera) {
  return gauss_newton(prior, measurements, camera, prior.pose);
}

/// The paper's: one map in the world frame, independent landmarks, all of them updated in every frame.
class GlobalMap {
 public:
  PoseGaussian<double> process(const DriveFrame& frame, const Drive& drive) {
    const StereoCamera& camera = drive.camera;
    if (started_) {
      state_ = predict_closed_form<double>(state_, frame.T_previous_this,
                                           {Pose::identity(), Drive::odometry_covariance()});
      state_ = update_pose(state_, known_points(map_, frame, state_.pose, camera), camera);
    }
    started_ = true;
    for (const auto& o : frame.observations) {
      const Matrix3<double> R = Drive::pixel_covariance();
      const Vector3<double> p = camera.back_project(o.z);
      Eigen::Matrix<double, 3, 6> J_pose;  // of the point in the world
      J_pose << -state_.pose.rotation_matrix() * antipode::skew(p), state_.pose.rotation_matrix();
      const auto entry = map_.find(o.point);
      if (entry == map_.end()) {
        const Matrix3<double> J = state_.pose.rotation_matrix() * camera.back_projection_jacobian(o.z);
        map_[o.point] = {state_.pose * p,
                         J * R * J.transpose() + J_pose * state_.covariance * J_pose.transpose()};
        continue;
      }
      // Alg. 4 to first order.
      auto& [mean, covariance] = entry->second;
      const Vector3<double> p_map = state_.pose.inverse() * mean;
      if (p_map.z() < 1.0) continue;
      const Matrix3<double> H = camera.projection_jacobian(p_map) * state_.pose.rotation_matrix().transpose();
      const Eigen::Matrix<double, 3, 6> H_pose = measurement_jacobian(camera, p_map);
      const Matrix3<double> S =
          H * covariance * H.transpose() + H_pose * state_.covariance * H_pose.transpose() + R;
      const Matrix3<double> K = S.llt().solve(H * covariance).transpose();
      mean += K * (o.z - camera.project_unchecked(p_map));
      covariance -= K * S * K.transpose();
    }
    return state_;
  }

 private:
  bool started_ = false;
  PoseGaussian<double> state_ = certain();
  std::unordered_map<std::size_t, PointEstimate> map_;
};

/// Pose and landmarks relative to a keyframe; landmarks are the keyframe's own triangulations.
class Anchored {
 public:
  /// recursive: the prior is the last posterior moved by the odometry, otherwise the odometry since the
  /// keyframe.
  explicit Anchored(bool recursive) : recursive_(recursive) {}

  PoseGaussian<double> process(const DriveFrame& frame, const Drive& drive) {
    if (map_.empty()) {
      start_keyframe(frame, drive);
      return T_world_keyframe_;
    }
    const PoseGaussian<double> noise{Pose::identity(), Drive::odometry_covariance()};
    const auto prior = predict_closed_form<double>(state_, frame.T_previous_this, noise);
    const auto points = known_points(map_, frame, prior.pose, drive.camera);
    const auto posterior = update_pose(prior, points, drive.camera);
    state_ = recursive_ ? posterior : prior;
    const auto T_world_camera = predict_closed_form<double>(T_world_keyframe_, posterior.pose,
                                                            {Pose::identity(), posterior.covariance});
    if (static_cast<double>(points.size()) < 0.6 * static_cast<double>(map_.size())) {
      T_world_keyframe_ = T_world_camera;
      start_keyframe(frame, drive);
    }
    return T_world_camera;
  }

 private:
  void start_keyframe(const DriveFrame& frame, const Drive& drive) {
    state_ = certain();
    map_.clear();
    for (const auto& o : frame.observations) {
      const Matrix3<double> J = drive.camera.back_projection_jacobian(o.z);
      map_[o.point] = {drive.camera.back_project(o.z), J * Drive::pixel_covariance() * J.transpose()};
    }
  }

  bool recursive_;
  PoseGaussian<double> T_world_keyframe_ = certain();
  PoseGaussian<double> state_ = certain();
  std::unordered_map<std::size_t, PointEstimate> map_;
};

/// Anchored and recursive, with the correlation that the landmarks' errors leave in the pose: a landmark's
/// error is the same in every frame, so the pose's is correlated with it from the first update on. Landmarks
/// are not updated (Schmidt's consider filter), and neither is the keyframe's own pose, whose error is
/// correlated with the landmarks that share a pixel with the keyframe's last update.
class Considered {
 public:
  PoseGaussian<double> process(const DriveFrame& frame, const Drive& drive) {
    if (map_.empty()) {
      start_keyframe(frame, drive, {});
      return T_world_keyframe_;
    }
    predict(frame.T_previous_this);
    const auto gains = update(frame, drive.camera);
    const auto T_world_camera = in_world();
    if (static_cast<double>(gains.size()) < 0.6 * static_cast<double>(map_.size())) {
      T_world_keyframe_ = T_world_camera;
      start_keyframe(frame, drive, gains);
    }
    return T_world_camera;
  }

 private:
  using Gain = Eigen::Matrix<double, 6, 3>;
  struct Point {
    PointEstimate estimate;
    Gain with_pose = Gain::Zero();      ///< Cov(e, l)
    Gain with_keyframe = Gain::Zero();  ///< Cov(e_keyframe, l)
  };

  void predict(const Pose& motion) {
    const Matrix6<double> A = motion.inverse().adjoint();
    state_ = predict_closed_form<double>(state_, motion, {Pose::identity(), Drive::odometry_covariance()});
    with_keyframe_ = A * with_keyframe_;
    for (auto& [id, point] : map_) point.with_pose = A * point.with_pose;
  }

  std::unordered_map<std::size_t, Gain> update(const DriveFrame& frame, const StereoCamera& camera) {
    using Matrix12 = Eigen::Matrix<double, 12, 12>;
    struct Row {
      std::size_t id;
      Eigen::Matrix<double, 3, 12> U;
      Matrix3<double> J, D_inverse;
      Vector3<double> y;
    };
    std::vector<Row> rows;
    Matrix12 N = Matrix12::Zero();
    Eigen::Matrix<double, 12, 1> b = Eigen::Matrix<double, 12, 1>::Zero();
    for (const auto& o : frame.observations) {
      const auto entry = map_.find(o.point);
      if (entry == map_.end()) continue;
      const Point& point = entry->second;
      const Vector3<double> p = state_.pose.inverse() * point.estimate.mean;
      if (p.z() < 1.0) continue;
      Row row;
      row.id = o.point;
      row.J = camera.projection_jacobian(p) * state_.pose.rotation_matrix().transpose();
      row.U << measurement_jacobian(camera, p), row.J * point.with_pose.transpose();
      row.D_inverse =
          (row.J * point.estimate.covariance * row.J.transpose() + Drive::pixel_covariance()).inverse();
      row.y = o.z - camera.project_unchecked(p);
      N += row.U.transpose() * row.D_inverse * row.U;
      b += row.U.transpose() * row.D_inverse * row.y;
      rows.push_back(row);
    }
    Matrix12 M_inverse = Matrix12::Zero();
    M_inverse.topRightCorner<6, 6>().setIdentity();
    M_inverse.bottomLeftCorner<6, 6>().setIdentity();
    M_inverse.bottomRightCorner<6, 6>() = -state_.covariance;
    const Eigen::Matrix<double, 6, 12> X = (M_inverse + N).inverse().topRows<6>();
    const Matrix6<double> KH = X * N.leftCols<6>();
    std::unordered_map<std::size_t, Gain> gains;
    Matrix6<double> with_keyframe = with_keyframe_ - KH * with_keyframe_;
    for (auto& [id, point] : map_) point.with_pose -= (KH * point.with_pose).eval();
    for (const auto& row : rows) {
      Point& point = map_.at(row.id);
      const Gain K = X * row.U.transpose() * row.D_inverse;
      point.with_pose -= K * row.J * point.estimate.covariance;
      with_keyframe -= K * row.J * point.with_keyframe.transpose();
      gains[row.id] = K;
    }
    with_keyframe_ = with_keyframe;
    Eigen::Matrix<double, 12, 6> W;
    W << state_.covariance, Matrix6<double>::Identity();
    const Matrix6<double> P = state_.covariance - X * N * W;
    state_ = {state_.pose.boxplus(X * b).renormalized(), 0.5 * (P + P.transpose())};
    return gains;
  }

  [[nodiscard]] PoseGaussian<double> in_world() const {
    const Matrix6<double> A = state_.pose.inverse().adjoint();
    const Matrix6<double> cross = A * with_keyframe_.transpose();
    return {(T_world_keyframe_.pose * state_.pose).renormalized(),
            A * T_world_keyframe_.covariance * A.transpose() + state_.covariance + cross + cross.transpose()};
  }

  void start_keyframe(const DriveFrame& frame, const Drive& drive,
                      const std::unordered_map<std::size_t, Gain>& gains) {
    state_ = certain();
    with_keyframe_.setZero();
    map_.clear();
    for (const auto& o : frame.observations) {
      const Matrix3<double> J = drive.camera.back_projection_jacobian(o.z);
      Point& point = map_[o.point];
      point.estimate = {drive.camera.back_project(o.z), J * Drive::pixel_covariance() * J.transpose()};
      const auto gain = gains.find(o.point);
      if (gain != gains.end()) point.with_keyframe = gain->second * Drive::pixel_covariance() * J.transpose();
    }
  }

  PoseGaussian<double> T_world_keyframe_ = certain();
  PoseGaussian<double> state_ = certain();
  Matrix6<double> with_keyframe_ = Matrix6<double>::Zero();  ///< Cov(e, e_keyframe)
  std::unordered_map<std::size_t, Point> map_;
};

}  // namespace consistency
