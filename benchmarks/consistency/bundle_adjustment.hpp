// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <map>
#include <unordered_map>
#include <vector>

#include <Eigen/Cholesky>
#include <ceres/ceres.h>

#include <antipode/ceres/pose_manifold.hpp>

#include "drive.hpp"

namespace consistency {

/// Whitened error of a stereo measurement as a function of the camera's pose and the point.
struct StereoError {
  StereoCamera camera;
  Vector3<double> z;
  Matrix3<double> root_information;

  template <class T>
  bool operator()(const T* pose, const T* point, T* error) const {
    const auto T_world_camera = antipode::ConstDualQuaternionView<T>(pose);
    const Eigen::Matrix<T, 3, 1> p =
        T_world_camera.inverse() * Eigen::Matrix<T, 3, 1>(Eigen::Map<const Eigen::Matrix<T, 3, 1>>(point));
    if (!(p.z() > T(StereoCamera::kMinDepth_m))) return false;
    const Eigen::Matrix<T, 3, 1> e(z.x() - camera.fx * p.x() / p.z() - camera.cx,
                                   z.y() - camera.fy * p.y() / p.z() - camera.cy,
                                   z.z() - camera.fx * camera.baseline_m / p.z());
    Eigen::Map<Eigen::Matrix<T, 3, 1>>{error} = root_information.cast<T>() * e;
    return true;
  }
};

/// The yardstick of accuracy: bundle adjustment of the current frame and the last keyframes with everything
/// they saw, the oldest pose held fixed. A keyframe is taken when fewer than 60 % of the last one's points
/// are still in view.
class SlidingWindow {
 public:
  SlidingWindow(const StereoCamera& camera, std::size_t keyframes) : camera_(camera), size_(keyframes) {
    root_information_ = Drive::pixel_covariance().inverse().llt().matrixU();
  }

  /// The pose of the next frame.
  Pose process(const DriveFrame& frame) {
    const Pose start =
        window_.empty() ? Pose::identity() : (current_.pose * frame.T_previous_this).renormalized();
    current_ = {start, frame.observations};
    for (const auto& o : frame.observations) {
      points_.try_emplace(o.point, start * camera_.back_project(o.z));
    }
    if (window_.empty()) {
      window_.push_back(current_);
      return start;
    }
    adjust();
    if (shared_with_keyframe() < 0.6 * static_cast<double>(window_.back().observations.size())) {
      window_.push_back(current_);
      if (window_.size() > size_) window_.erase(window_.begin());
    }
    return current_.pose;
  }

 private:
  struct View {
    Pose pose = Pose::identity();
    std::vector<Observation> observations;
  };

  [[nodiscard]] double shared_with_keyframe() const {
    double shared = 0.0;
    for (const auto& o : window_.back().observations) {
      for (const auto& c : current_.observations) shared += c.point == o.point;
    }
    return shared;
  }

  void adjust() {
    ceres::Problem::Options problem_options;
    problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(problem_options);
    antipode::PoseManifold manifold;
    std::vector<View*> views;
    for (auto& view : window_) views.push_back(&view);
    views.push_back(&current_);
    std::vector<std::array<double, 8>> poses(views.size());
    std::map<std::size_t, std::array<double, 3>> points;
    auto* ordering = new ceres::ParameterBlockOrdering;
    for (std::size_t i = 0; i < views.size(); ++i) {
      Eigen::Map<antipode::Vector8<double>>(poses[i].data()) = views[i]->pose.coeffs();
      problem.AddParameterBlock(poses[i].data(), 8, &manifold);
      ordering->AddElementToGroup(poses[i].data(), 1);
      for (const auto& o : views[i]->observations) {
        auto [entry, added] = points.try_emplace(o.point);
        if (added) Eigen::Map<Vector3<double>>(entry->second.data()) = points_.at(o.point);
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<StereoError, 3, 8, 3>(
                                     new StereoError{camera_, o.z, root_information_}),
                                 nullptr, poses[i].data(), entry->second.data());
        if (added) ordering->AddElementToGroup(entry->second.data(), 0);
      }
    }
    problem.SetParameterBlockConstant(poses.front().data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering.reset(ordering);
    options.max_num_iterations = 5;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    for (std::size_t i = 0; i < views.size(); ++i) {
      views[i]->pose = Pose::unchecked(Eigen::Map<antipode::Vector8<double>>(poses[i].data())).renormalized();
    }
    for (const auto& [id, point] : points) points_[id] = Eigen::Map<const Vector3<double>>(point.data());
  }

  StereoCamera camera_;
  std::size_t size_;
  Matrix3<double> root_information_;
  std::vector<View> window_;
  View current_;
  std::unordered_map<std::size_t, Vector3<double>> points_;
};

}  // namespace consistency
