// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/two_view_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include <antipode/filters/robust_least_squares.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/quaternion.hpp>

#include "stereo_slam/core/pixel_noise.hpp"

namespace stereo_slam {
namespace {

constexpr double kMinDisparity_px = 0.05;

/// A correspondence linearised at a pose and a point.
struct Linearization {
  Vector3<double> innovation;          // of the current measurement, for the point at its first measurement
  Eigen::Matrix<double, 3, 6> J_pose;  // d z_current / d xi, right perturbation (rotation, translation)
  Matrix3<double> J_point;             // d z_current / d (u, v, d) of the point in the previous frame
};

/// Nothing when the point is not in front of the current camera.
[[nodiscard]] std::optional<Linearization> linearize(const StereoCorrespondence& c, const StereoPoint& point,
                                                     const Pose& T_current_previous,
                                                     const StereoCamera& camera) {
  const Vector3<double> p_previous = camera.back_project(point);
  const Vector3<double> p_current = T_current_previous * p_previous;
  const auto z = camera.project(p_current);
  if (!z) return std::nullopt;
  const Matrix3<double> J_projection = camera.projection_jacobian(p_current);
  Linearization result;
  result.J_pose.leftCols<3>() = J_projection * antipode::skew(p_current);
  result.J_pose.rightCols<3>() = -J_projection;
  result.J_point =
      J_projection * T_current_previous.rotation_matrix() * camera.back_projection_jacobian(point);
  result.innovation = c.current - *z + result.J_point * (point - c.previous);
  return result;
}

[[nodiscard]] Matrix3<double> innovation_covariance(const Linearization& l, const Matrix3<double>& R) {
  return R + l.J_point * R * l.J_point.transpose();
}

/// The correspondences as measurements of the motion. The points in between are eliminated: each is where it
/// fits best at the motion of the last evaluation.
struct EliminatedPoints {
  std::span<const StereoCorrespondence> correspondences;
  const StereoCamera& camera;
  const std::vector<Matrix3<double>>& R;          // of each measurement
  const std::vector<Matrix3<double>>& S_inverse;  // of each innovation, at the initial motion
  const std::vector<std::uint8_t>& is_used;
  std::vector<StereoPoint>& points;  // in the previous frame
  /// Whether the covariances of the innovations are computed anew in each step. The initial motion is nearly
  /// always close enough.
  bool recomputes_S = false;

  template <class Sums>
  void operator()(const Pose& T_previous_current, Sums& sums) const {
    const Pose T_current_previous = T_previous_current.inverse();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!is_used[i]) continue;
      const auto l = linearize(correspondences[i], points[i], T_current_previous, camera);
      if (!l) continue;
      const Matrix3<double> information =
          recomputes_S ? Matrix3<double>(innovation_covariance(*l, R[i]).inverse()) : S_inverse[i];
      sums.add(l->innovation, information, l->J_pose);
      points[i] = correspondences[i].previous + R[i] * l->J_point.transpose() * information * l->innovation;
      points[i].z() = std::max(points[i].z(), kMinDisparity_px);
    }
  }
};

}  // namespace

TwoViewAdjustment::TwoViewAdjustment(std::span<const StereoCorrespondence> correspondences,
                                     const StereoCamera& camera, const Pose& initial, double sigma_px,
                                     bool own_noise)
    : correspondences_(correspondences), camera_(camera) {
  const Matrix3<double> equal_noise = stereo_pixel_covariance(sigma_px);
  const Pose T_current_previous = initial.inverse();
  R_.reserve(correspondences.size());
  S_inverse_.reserve(correspondences.size());
  for (const auto& c : correspondences) {
    const Matrix3<double>& R = R_.emplace_back(own_noise ? c.R.value_or(equal_noise) : equal_noise);
    const auto l = linearize(c, c.previous, T_current_previous, camera_);
    const Matrix3<double> S = l ? innovation_covariance(*l, R) : Matrix3<double>(2.0 * R);
    S_inverse_.push_back(S.inverse());
  }
}

std::optional<Pose> TwoViewAdjustment::minimal_solution(const std::array<std::size_t, 3>& sample,
                                                        const Pose& initial) const {
  constexpr int kMinimalIterations = 6;
  constexpr double kMinimalStep = 1e-4;         // rad, m
  constexpr double kLargestRotation_rad = 1.0;  // of one step; a larger one has left the basin
  Pose pose = initial;
  for (int iteration = 0; iteration < kMinimalIterations; ++iteration) {
    antipode::WeightedSums<double, 6> sums;
    const Pose T_current_previous = pose.inverse();
    for (const std::size_t i : sample) {
      const auto l =
          linearize(correspondences_[i], correspondences_[i].previous, T_current_previous, camera_);
      if (!l) return std::nullopt;
      sums.add(l->innovation, S_inverse_[i], l->J_pose);
    }
    const auto root = sums.root();
    if (!root) return std::nullopt;
    const Vector6<double> step = sums.solve(*root, sums.vector());
    if (!(step.head<3>().norm() <= kLargestRotation_rad)) return std::nullopt;
    pose = pose.boxplus(step);
    if (step.norm() < kMinimalStep) break;
  }
  return pose;
}

std::vector<double> TwoViewAdjustment::squared_distances(const Pose& T_previous_current) const {
  const Pose T_current_previous = T_previous_current.inverse();
  const Matrix3<double> R = T_current_previous.rotation_matrix();
  const Vector3<double> t = T_current_previous.translation();
  std::vector<double> result(correspondences_.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < result.size(); ++i) {
    const auto z = camera_.project(R * camera_.back_project(correspondences_[i].previous) + t);
    if (!z) continue;
    const Vector3<double> e = correspondences_[i].current - *z;
    result[i] = e.dot(S_inverse_[i] * e);
  }
  return result;
}

std::optional<PoseGaussian> TwoViewAdjustment::solve(const Pose& initial,
                                                     const std::vector<std::uint8_t>& is_used) const {
  // The points move with the motion, and with them the cost: near its minimum, a step may cost a quarter of a
  // unit of squared Mahalanobis distance more.
  const antipode::LeastSquaresOptions<double> options{.max_iterations = 20,
                                                      .max_increase = 0.25,
                                                      .covariance = antipode::CovarianceFrom::kResiduals,
                                                      .check_modes = false};
  using Poses = antipode::ScrewChart<double>;
  std::vector<StereoPoint> points;
  points.reserve(correspondences_.size());
  for (const auto& c : correspondences_) points.push_back(c.previous);
  EliminatedPoints model{correspondences_, camera_, R_, S_inverse_, is_used, points};
  auto fit = antipode::robust_least_squares<Poses>(initial, model, kOutlierLoss, options);
  if (fit.status == antipode::LeastSquaresStatus::kNotSettled) {
    model.recomputes_S = true;
    fit = antipode::robust_least_squares<Poses>(fit.state, model, kOutlierLoss, options);
  }
  if (!fit.covariance.allFinite()) return std::nullopt;
  return PoseGaussian{fit.state, fit.covariance};
}

}  // namespace stereo_slam
