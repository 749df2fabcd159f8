// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/two_view_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/LU>

#include <antipode/geometry/quaternion.hpp>

#include "stereo_slam/core/symmetric_solve.hpp"

namespace stereo_slam {
namespace {

constexpr double kCauchyScale2 = 6.0;  // squared Mahalanobis distance at which a weight halves
constexpr int kMaxIterations = 15;
// Near the minimum a step may cost a little more, since the covariances of the innovations are those at the
// initial motion: half a unit of squared Mahalanobis distance.
constexpr double kTolerance = 0.5 / kCauchyScale2;
constexpr double kConvergedStep = 1e-6;  // rad, m
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

/// Normal equations of the pose, for its right perturbation.
struct NormalEquations {
  Matrix6<double> information = Matrix6<double>::Zero();
  Vector6<double> gradient = Vector6<double>::Zero();

  void add(const Linearization& l, const Matrix3<double>& S_inverse, double weight) {
    const Eigen::Matrix<double, 6, 3> JtW = weight * l.J_pose.transpose() * S_inverse;
    information.noalias() += JtW * l.J_pose;
    gradient.noalias() += JtW * l.innovation;
  }
};

[[nodiscard]] double cauchy_weight(double distance2) { return 1.0 / (1.0 + distance2 / kCauchyScale2); }

/// A correspondence as one step of the adjustment uses it.
struct UsedCorrespondence {
  std::size_t index = 0;
  Linearization linearization;
  Matrix3<double> S_inverse = Matrix3<double>::Zero();
  double distance2 = 0.0;  // squared Mahalanobis distance of the innovation
};

/// Covariance A^-1 B A^-1 of an M-estimate: B is the variance of the weighted residuals as observed, A the
/// mean slope of the influence function.
[[nodiscard]] Matrix6<double> sandwich_covariance(const std::vector<UsedCorrespondence>& used) {
  Matrix6<double> A = Matrix6<double>::Zero();
  Matrix6<double> B = Matrix6<double>::Zero();
  for (const auto& [i, l, S_inverse, distance2] : used) {
    const Matrix6<double> information = l.J_pose.transpose() * S_inverse * l.J_pose;
    const double w = cauchy_weight(distance2);
    A += (w - 2.0 / 3.0 * distance2 * w * w / kCauchyScale2) * information;
    B += w * w * distance2 / 3.0 * information;
  }
  const Matrix6<double> A_inverse = solve_symmetric(A, Matrix6<double>::Identity());
  const Matrix6<double> covariance = A_inverse * B * A_inverse.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

/// The correspondences of an adjustment, with the covariance of each measurement, its inverse, and the
/// inverse of that of each innovation at the initial motion.
struct Problem {
  std::span<const StereoCorrespondence> correspondences;
  const StereoCamera& camera;
  const std::vector<Matrix3<double>>& R;
  const std::vector<Matrix3<double>>& S_inverse;
  const std::vector<std::uint8_t>& is_used;
};

/// The motion at which the covariances of the innovations are computed.
enum class CovarianceAt {
  kInitial,   ///< once; the initial motion is nearly always close enough
  kEstimate,  ///< anew in each step
};

/// The motion and the points at one step.
struct Estimate {
  Pose T_previous_current;
  std::vector<StereoPoint> points{};  // in the previous frame
};

/// The problem linearised at an estimate. Used for several estimates in turn, it allocates nothing.
class LinearizedProblem {
 public:
  explicit LinearizedProblem(const Problem& problem) : problem_(&problem) {
    used_.reserve(problem.correspondences.size());
  }

  void linearize_at(const Estimate& estimate, CovarianceAt covariance_at) {
    constexpr double kLargestProduct = 1e100;
    equations_ = {};
    used_.clear();
    cost_ = 0.0;
    double product = 1.0;  // of numbers whose logarithms are summed
    const Pose T_current_previous = estimate.T_previous_current.inverse();
    for (std::size_t i = 0; i < estimate.points.size(); ++i) {
      if (!problem_->is_used[i]) continue;
      const auto l =
          linearize(problem_->correspondences[i], estimate.points[i], T_current_previous, problem_->camera);
      if (!l) continue;
      const Matrix3<double> S_inverse = covariance_at == CovarianceAt::kInitial
                                            ? problem_->S_inverse[i]
                                            : innovation_covariance(*l, problem_->R[i]).inverse();
      const double distance2 = l->innovation.dot(S_inverse * l->innovation);
      equations_.add(*l, S_inverse, cauchy_weight(distance2));
      used_.push_back({i, *l, S_inverse, distance2});
      product *= 1.0 + distance2 / kCauchyScale2;
      if (product < kLargestProduct) continue;
      cost_ += std::log(product);
      product = 1.0;
    }
    cost_ += std::log(product);
  }

  [[nodiscard]] const NormalEquations& equations() const noexcept { return equations_; }
  [[nodiscard]] const std::vector<UsedCorrespondence>& used() const noexcept { return used_; }

  /// By Cauchy's loss.
  [[nodiscard]] double cost() const noexcept { return cost_; }

  /// Whether the next step is longer than a tenth of a standard deviation of the motion: as a mean error,
  /// that is one standard deviation of the path after a hundred motions.
  [[nodiscard]] bool is_far_from_minimum() const {
    constexpr double kShare = 0.1;
    const auto step = solve_semidefinite(equations_.information, equations_.gradient);
    return step && step->dot(equations_.gradient) > kShare * kShare;
  }

  /// The estimate after a step of the motion: each point moves to where it fits best then.
  void move(const Estimate& from, const Vector6<double>& step, Estimate& to) const {
    to.T_previous_current = from.T_previous_current.boxplus(step).renormalized();
    to.points = from.points;
    for (const auto& [i, l, S_inverse, distance2] : used_) {
      const Vector3<double> correction =
          problem_->R[i] * l.J_point.transpose() * S_inverse * (l.innovation - l.J_pose * step);
      to.points[i] = problem_->correspondences[i].previous + correction;
      to.points[i].z() = std::max(to.points[i].z(), kMinDisparity_px);
    }
  }

 private:
  const Problem* problem_;
  NormalEquations equations_;
  std::vector<UsedCorrespondence> used_;
  double cost_ = 0.0;
};

}  // namespace

TwoViewAdjustment::TwoViewAdjustment(std::span<const StereoCorrespondence> correspondences,
                                     const StereoCamera& camera, const Pose& initial, const NoiseOf& noise)
    : correspondences_(correspondences), camera_(camera) {
  const Pose T_current_previous = initial.inverse();
  R_.reserve(correspondences.size());
  S_inverse_.reserve(correspondences.size());
  for (const auto& c : correspondences) {
    const Matrix3<double>& R = R_.emplace_back(noise(c));
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
    NormalEquations equations;
    const Pose T_current_previous = pose.inverse();
    for (const std::size_t i : sample) {
      const auto l =
          linearize(correspondences_[i], correspondences_[i].previous, T_current_previous, camera_);
      if (!l) return std::nullopt;
      equations.add(*l, S_inverse_[i], 1.0);
    }
    const auto step = solve_semidefinite(equations.information, equations.gradient);
    if (!step || step->head<3>().norm() > kLargestRotation_rad) return std::nullopt;
    pose = pose.boxplus(*step);
    if (step->norm() < kMinimalStep) break;
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
  Estimate accepted{initial};
  accepted.points.reserve(correspondences_.size());
  for (const auto& c : correspondences_) accepted.points.push_back(c.previous);
  Estimate next = accepted;
  const Problem problem{correspondences_, camera_, R_, S_inverse_, is_used};
  LinearizedProblem at_accepted(problem);
  LinearizedProblem at_next(problem);
  CovarianceAt covariance_at = CovarianceAt::kInitial;
  at_accepted.linearize_at(accepted, covariance_at);
  double least_cost = at_accepted.cost();
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const NormalEquations equations = at_accepted.equations();
    const auto step = solve_semidefinite(equations.information, equations.gradient);
    if (!step) return std::nullopt;
    at_accepted.move(accepted, *step, next);
    if (step->norm() < kConvergedStep) {
      std::swap(accepted, next);
      break;
    }
    at_next.linearize_at(next, covariance_at);
    if (at_next.cost() <= least_cost + kTolerance) {
      std::swap(accepted, next);
      std::swap(at_accepted, at_next);
      least_cost = std::min(least_cost, at_accepted.cost());
      continue;
    }
    if (covariance_at == CovarianceAt::kEstimate) break;
    covariance_at = CovarianceAt::kEstimate;
    at_next.linearize_at(accepted, covariance_at);
    if (!at_next.is_far_from_minimum()) break;
    std::swap(at_accepted, at_next);
    least_cost = at_accepted.cost();
  }
  if (at_accepted.used().empty()) return std::nullopt;
  return PoseGaussian{accepted.T_previous_current, sandwich_covariance(at_accepted.used())};
}

}  // namespace stereo_slam
