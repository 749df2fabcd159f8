// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/motion_estimation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <antipode/geometry/quaternion.hpp>

#include "stereo_slam/core/chi_square.hpp"

namespace stereo_slam {
namespace {

constexpr double kCauchyScale2 = 6.0;  // squared Mahalanobis distance at which a weight halves
constexpr int kMaxIterations = 15;
constexpr double kConvergedStep = 1e-6;  // rad, m
constexpr double kMinDisparity_px = 0.05;
constexpr double kWidestRotation_rad = 0.3;  // a rotation that is known less well was not measured

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

/// Normal equations of the pose, for its right perturbation.
struct NormalEquations {
  Matrix6<double> information = Matrix6<double>::Zero();
  Vector6<double> gradient = Vector6<double>::Zero();

  void add(const Linearization& l, const Matrix3<double>& S_inverse, double weight) {
    const Eigen::Matrix<double, 6, 3> JtW = weight * l.J_pose.transpose() * S_inverse;
    information.noalias() += JtW * l.J_pose;
    gradient.noalias() += JtW * l.innovation;
  }

  [[nodiscard]] std::optional<Vector6<double>> solve() const {
    const Eigen::LDLT<Matrix6<double>> ldlt(information);
    if (ldlt.info() != Eigen::Success || !ldlt.isPositive()) return std::nullopt;
    const Vector6<double> step = ldlt.solve(gradient);
    if (!step.allFinite()) return std::nullopt;
    return step;
  }
};

/// The estimation problem with the innovation covariances frozen at a given motion.
class MotionProblem {
 public:
  using NoiseOf = std::function<Matrix3<double>(const StereoCorrespondence&)>;

  MotionProblem(std::span<const StereoCorrespondence> correspondences, const StereoCamera& camera,
                const Pose& initial, const NoiseOf& noise)
      : correspondences_(correspondences), camera_(camera) {
    const Pose T_current_previous = initial.inverse();
    R_.reserve(correspondences.size());
    S_inverse_.reserve(correspondences.size());
    for (const auto& c : correspondences) {
      const Matrix3<double>& R = R_.emplace_back(noise(c));
      const auto l = linearize(c, c.previous, T_current_previous, camera_);
      const Matrix3<double> S = l ? Matrix3<double>(R + l->J_point * R * l->J_point.transpose()) : 2.0 * R;
      S_inverse_.push_back(S.inverse());
    }
  }

  /// Pose through three correspondences, the points taken as measured.
  [[nodiscard]] std::optional<Pose> minimal_solution(const std::array<std::size_t, 3>& sample,
                                                     Pose pose) const {
    constexpr int kMinimalIterations = 6;
    constexpr double kMinimalStep = 1e-4;
    for (int iteration = 0; iteration < kMinimalIterations; ++iteration) {
      NormalEquations equations;
      const Pose T_current_previous = pose.inverse();
      for (const std::size_t i : sample) {
        const auto l =
            linearize(correspondences_[i], correspondences_[i].previous, T_current_previous, camera_);
        if (!l) return std::nullopt;
        equations.add(*l, S_inverse_[i], 1.0);
      }
      const auto step = equations.solve();
      if (!step || step->head<3>().norm() > 1.0) return std::nullopt;
      pose = pose.boxplus(*step);
      if (step->norm() < kMinimalStep) break;
    }
    return pose;
  }

  /// Squared Mahalanobis distance of every correspondence, infinite behind the camera.
  [[nodiscard]] std::vector<double> distances(const Pose& pose) const {
    const Pose T_current_previous = pose.inverse();
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

  /// Robust two-view adjustment over the flagged correspondences.
  [[nodiscard]] std::optional<PoseGaussian> adjust(Pose pose, const std::vector<std::uint8_t>& inlier) const {
    std::vector<StereoPoint> points;
    points.reserve(correspondences_.size());
    for (const auto& c : correspondences_) points.push_back(c.previous);

    std::vector<std::pair<std::size_t, Linearization>> used;
    std::vector<double> distance2;
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      NormalEquations equations;
      used.clear();
      distance2.clear();
      const Pose T_current_previous = pose.inverse();
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (!inlier[i]) continue;
        const auto l = linearize(correspondences_[i], points[i], T_current_previous, camera_);
        if (!l) continue;
        distance2.push_back(l->innovation.dot(S_inverse_[i] * l->innovation));
        equations.add(*l, S_inverse_[i], cauchy_weight(distance2.back()));
        used.emplace_back(i, *l);
      }
      const auto step = equations.solve();
      if (!step) return std::nullopt;
      pose = pose.boxplus(*step).renormalized();
      for (const auto& [i, l] : used) {
        const Vector3<double> correction =
            R_[i] * l.J_point.transpose() * S_inverse_[i] * (l.innovation - l.J_pose * *step);
        points[i] = correspondences_[i].previous + correction;
        points[i].z() = std::max(points[i].z(), kMinDisparity_px);
      }
      if (step->norm() < kConvergedStep) break;
    }
    if (distance2.empty()) return std::nullopt;
    return PoseGaussian{pose, sandwich_covariance(used, distance2)};
  }

 private:
  [[nodiscard]] static double cauchy_weight(double distance2) {
    return 1.0 / (1.0 + distance2 / kCauchyScale2);
  }

  /// Covariance A^-1 B A^-1 of an M-estimate (Huber 1981): B is the variance of the weighted residuals as
  /// observed, A the mean slope of the influence function. Follows the residuals' own scale.
  [[nodiscard]] Matrix6<double> sandwich_covariance(
      const std::vector<std::pair<std::size_t, Linearization>>& used,
      const std::vector<double>& distance2) const {
    Matrix6<double> A = Matrix6<double>::Zero();
    Matrix6<double> B = Matrix6<double>::Zero();
    for (std::size_t k = 0; k < used.size(); ++k) {
      const auto& [i, l] = used[k];
      const Matrix6<double> information = l.J_pose.transpose() * S_inverse_[i] * l.J_pose;
      const double w = cauchy_weight(distance2[k]);
      A += (w - 2.0 / 3.0 * distance2[k] * w * w / kCauchyScale2) * information;
      B += w * w * distance2[k] / 3.0 * information;
    }
    const Matrix6<double> A_inverse = A.ldlt().solve(Matrix6<double>::Identity());
    const Matrix6<double> covariance = A_inverse * B * A_inverse.transpose();
    return 0.5 * (covariance + covariance.transpose());
  }

  std::span<const StereoCorrespondence> correspondences_;
  const StereoCamera& camera_;
  std::vector<Matrix3<double>> R_;
  std::vector<Matrix3<double>> S_inverse_;
};

/// Whether the points determine the motion: near-singular equations give covariances that are huge, or not
/// positive definite after rounding.
[[nodiscard]] bool well_posed(const Matrix6<double>& covariance) {
  return covariance.allFinite() &&
         covariance.topLeftCorner<3, 3>().trace() < kWidestRotation_rad * kWidestRotation_rad &&
         Eigen::LLT<Matrix6<double>>(covariance).info() == Eigen::Success;
}

[[nodiscard]] std::array<std::size_t, 3> draw_three(std::size_t count, std::mt19937_64& random) {
  std::array<std::size_t, 3> sample{};
  do {
    for (auto& i : sample) i = static_cast<std::size_t>(random() % count);
  } while (sample[0] == sample[1] || sample[1] == sample[2] || sample[0] == sample[2]);
  return sample;
}

[[nodiscard]] std::vector<std::uint8_t> flag_inliers(const std::vector<double>& distance2) {
  std::vector<std::uint8_t> inlier(distance2.size());
  std::transform(distance2.begin(), distance2.end(), inlier.begin(),
                 [](double d) { return static_cast<std::uint8_t>(d < kChi2_3_99); });
  return inlier;
}

/// Random sets of three to draw so that one is free of outliers with a probability of 99.99 %.
[[nodiscard]] int sufficient_draws(double inlier_share) {
  constexpr double kMissed = 1e-4;
  const double clean = inlier_share * inlier_share * inlier_share;
  if (clean >= 1.0 - kMissed) return 1;
  return static_cast<int>(std::min(1e6, std::ceil(std::log(kMissed) / std::log1p(-clean))));
}

/// A motion, and the correspondences that agree with it.
struct Hypothesis {
  Pose pose;
  double cost = std::numeric_limits<double>::infinity();  ///< sum of truncated distances
  std::size_t inliers = 0;

  /// Becomes the other one if that is better.
  void compete(const Hypothesis& other) {
    if (other.cost < cost) *this = other;
  }
};

[[nodiscard]] Hypothesis judge(const MotionProblem& problem, const Pose& pose) {
  Hypothesis result{pose, 0.0, 0};
  for (const double d : problem.distances(pose)) {
    result.cost += std::min(d, kChi2_3_99);
    if (d < kChi2_3_99) ++result.inliers;
  }
  return result;
}

/// Whether at least `least` correspondences agree with the first pose, and `majority` times as many as with
/// the second. Correspondences that agree with both are not counted: far points agree with many motions.
[[nodiscard]] bool outvotes(const MotionProblem& problem, const std::pair<Pose, Pose>& pose_and_other,
                            std::size_t majority, std::size_t least) {
  const auto agree = flag_inliers(problem.distances(pose_and_other.first));
  const auto agree_with_other = flag_inliers(problem.distances(pose_and_other.second));
  std::size_t alone = 0;
  std::size_t other_alone = 0;
  for (std::size_t i = 0; i < agree.size(); ++i) {
    if (agree[i] && !agree_with_other[i]) ++alone;
    if (agree_with_other[i] && !agree[i]) ++other_alone;
  }
  return alone >= std::max(least, majority * other_alone);
}

/// Pose with the smallest sum of truncated distances over random minimal sets; the expected one competes too.
/// Ends early if a better pose is improbable and the best one continues the expected motion, otherwise after
/// settings.ransac_iterations.
///
/// The points of a moving object that fills half of the image, such as a lorry ahead, agree on one motion as
/// well as those of the street. A motion that does not continue the expected one therefore has to outvote the
/// best one that does.
[[nodiscard]] Pose ransac(const MotionProblem& problem, std::size_t count, const ExpectedMotion& expected,
                          const OdometrySettings& settings, std::mt19937_64& random) {
  const Pose& initial = expected.T_previous_current;
  Hypothesis best = judge(problem, initial);
  Hypothesis best_continuing = best;
  for (int iteration = 0; iteration < settings.ransac_iterations; ++iteration) {
    const double share = static_cast<double>(best.inliers) / static_cast<double>(count);
    if (iteration >= sufficient_draws(share) && continues(best.pose, initial)) break;
    const auto pose = problem.minimal_solution(draw_three(count, random), initial);
    if (!pose) continue;
    const Hypothesis drawn = judge(problem, *pose);
    best.compete(drawn);
    if (continues(*pose, initial)) best_continuing.compete(drawn);
  }
  if (continues(best.pose, initial)) return best.pose;
  const std::size_t majority = expected.from == Expectation::kDoubtful ? 1 : 4;
  const int least = expected.from == Expectation::kSteady ? 2 * std::max(0, settings.min_inliers) : 0;
  const bool jerk =
      outvotes(problem, {best.pose, best_continuing.pose}, majority, static_cast<std::size_t>(least));
  return jerk ? best.pose : best_continuing.pose;
}

}  // namespace

bool continues(const Pose& motion, const Pose& expected) {
  constexpr double kChange = 0.5;  // of the motion, relative
  constexpr double kRotation_rad = 0.03;
  constexpr double kTranslation_m = 0.05;
  const Vector6<double> size = expected.boxminus(Pose::identity());
  const Vector6<double> change = motion.boxminus(expected);
  return change.head<3>().norm() < kChange * size.head<3>().norm() + kRotation_rad &&
         change.tail<3>().norm() < kChange * size.tail<3>().norm() + kTranslation_m;
}

MotionEstimate estimate_motion(const MotionCorrespondences& correspondences, const StereoCamera& camera,
                               const ExpectedMotion& expected, const OdometrySettings& settings,
                               std::mt19937_64& random) {
  const auto& [points, static_points] = correspondences;
  MotionEstimate result;
  result.T_previous_current.pose = expected.T_previous_current;
  result.inlier.assign(points.size(), 0);
  const auto required = static_cast<std::size_t>(std::max(3, settings.min_inliers));
  if (points.size() < required) return result;

  const MotionProblem::NoiseOf equal_noise = [&settings](const StereoCorrespondence&) {
    return stereo_pixel_covariance(settings.pixel_sigma_px);
  };
  const MotionProblem::NoiseOf own_noise = [&equal_noise](const StereoCorrespondence& c) {
    return c.R ? *c.R : equal_noise(c);
  };
  std::vector<StereoCorrespondence> voters(points.begin(), points.end());
  voters.insert(voters.end(), static_points.begin(), static_points.end());
  const MotionProblem rough(voters, camera, expected.T_previous_current, equal_noise);
  Pose pose = ransac(rough, voters.size(), expected, settings, random);
  result.jerk = expected.from != Expectation::kNoMotion && !continues(pose, expected.T_previous_current);

  constexpr int kReselections = 2;
  std::optional<PoseGaussian> solution;
  for (int round = 0; round < kReselections; ++round) {
    result.inlier = flag_inliers(MotionProblem(points, camera, pose, equal_noise).distances(pose));
    result.inliers = static_cast<int>(std::count(result.inlier.begin(), result.inlier.end(), 1));
    if (result.inliers < static_cast<int>(required)) return result;
    solution = MotionProblem(points, camera, pose, own_noise).adjust(pose, result.inlier);
    if (!solution) return result;
    pose = solution->pose;
  }

  result.T_previous_current = *solution;
  result.valid = well_posed(solution->covariance);
  return result;
}

}  // namespace stereo_slam
