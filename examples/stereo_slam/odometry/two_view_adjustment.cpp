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

/// The innovation of the current measurement, for the point at its first measurement; `seen` is the point
/// where it is now.
[[nodiscard]] Vector3<double> innovation_of(const StereoCorrespondence& c, const StereoPoint& point,
                                            const PointInSecond& seen) {
  return c.current - seen.z + seen.J_first * (point - c.previous);
}

[[nodiscard]] Matrix3<double> innovation_covariance(const PointInSecond& seen, const Matrix3<double>& R) {
  return R + seen.J_first * R * seen.J_first.transpose();
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
      const auto seen = seen_by_second(points[i], T_current_previous, camera);
      if (!seen) continue;
      const Vector3<double> innovation = innovation_of(correspondences[i], points[i], *seen);
      const Matrix3<double> information =
          recomputes_S ? Matrix3<double>(innovation_covariance(*seen, R[i]).inverse()) : S_inverse[i];
      sums.add(innovation, information, seen->J_motion);
      points[i] = correspondences[i].previous + R[i] * seen->J_first.transpose() * information * innovation;
      points[i].z() = std::max(points[i].z(), kMinDisparity_px);
    }
  }
};

}  // namespace

std::optional<PointInSecond> seen_by_second(const StereoPoint& first, const Pose& T_second_first,
                                            const StereoCamera& camera) {
  const Vector3<double> p = T_second_first * camera.back_project(first);
  const auto z = camera.project(p);
  if (!z) return std::nullopt;
  const Matrix3<double> J = camera.projection_jacobian(p);
  PointInSecond seen{*z, {}, J * T_second_first.rotation_matrix() * camera.back_projection_jacobian(first)};
  seen.J_motion << J * antipode::skew(p), -J;
  return seen;
}

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
    const auto seen = seen_by_second(c.previous, T_current_previous, camera_);
    const Matrix3<double> S = seen ? innovation_covariance(*seen, R) : Matrix3<double>(2.0 * R);
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
      const StereoCorrespondence& c = correspondences_[i];
      const auto seen = seen_by_second(c.previous, T_current_previous, camera_);
      if (!seen) return std::nullopt;
      sums.add(innovation_of(c, c.previous, *seen), S_inverse_[i], seen->J_motion);
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
