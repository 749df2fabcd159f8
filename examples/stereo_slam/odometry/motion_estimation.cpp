// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/motion_estimation.hpp"

#include <algorithm>
#include <limits>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/core/symmetric_solve.hpp"
#include "stereo_slam/odometry/three_point_sample.hpp"

namespace stereo_slam {
namespace {

constexpr double kWidestRotation_rad = 0.3;  // a rotation that is known less well was not measured

/// Whether the points determine the motion: near-singular equations give covariances that are huge, or not
/// positive definite after rounding.
[[nodiscard]] bool well_posed(const Matrix6<double>& covariance) {
  return covariance.allFinite() &&
         covariance.topLeftCorner<3, 3>().trace() < kWidestRotation_rad * kWidestRotation_rad &&
         inverse_of_definite(covariance);
}

/// A motion, and the correspondences that agree with it.
struct Hypothesis {
  Pose pose;
  double cost = std::numeric_limits<double>::infinity();  ///< minus twice the logarithm of its probability
  std::size_t inlier_count = 0;
};

/// The correspondences that RANSAC chooses a motion by.
struct Voters {
  const std::vector<StereoCorrespondence>& points;
  const TwoViewAdjustment& adjustment;
  const ExpectedMotion& expected;

  [[nodiscard]] Hypothesis judge(const Pose& pose) const {
    constexpr double kFarthest = ExpectedMotion::kSurprise * ExpectedMotion::kSurprise;
    Hypothesis result{pose, kChi2_3_99 * std::min(expected.squared_distance(pose), kFarthest), 0};
    const auto squared_distances = adjustment.squared_distances(pose);
    for (std::size_t i = 0; i < points.size(); ++i) {
      result.cost += points[i].static_evidence * std::min(squared_distances[i], kChi2_3_99);
      if (squared_distances[i] < kChi2_3_99) ++result.inlier_count;
    }
    return result;
  }
};

/// The most probable of the motions of random minimal sets; the expected one competes too. Ends early if a
/// better one is improbable and the best one is no surprise, otherwise after `iterations`.
[[nodiscard]] Pose ransac(const Voters& voters, int iterations, std::mt19937_64& random) {
  const Pose& initial = voters.expected.T_previous_current;
  Hypothesis best = voters.judge(initial);
  const auto count = voters.points.size();
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const double share = static_cast<double>(best.inlier_count) / static_cast<double>(count);
    if (iteration >= sufficient_draws(share) && !voters.expected.surprised_by(best.pose)) break;
    const auto pose = voters.adjustment.minimal_solution(draw_three(count, random), initial);
    if (!pose) continue;
    const Hypothesis other = voters.judge(*pose);
    if (other.cost < best.cost) best = other;
  }
  return best.pose;
}

}  // namespace

std::vector<std::uint8_t> agreement(std::span<const StereoCorrespondence> points, const StereoCamera& camera,
                                    const Pose& motion, const OdometrySettings& settings) {
  const TwoViewAdjustment adjustment(points, camera, motion, settings.pixel_sigma_px, /*own_noise=*/false);
  std::vector<std::uint8_t> agrees;
  for (const double distance2 : adjustment.squared_distances(motion))
    agrees.push_back(distance2 < kChi2_3_99);
  return agrees;
}

MotionEstimate estimate_motion(std::span<const StereoCorrespondence> points, const StereoCamera& camera,
                               const ExpectedMotion& expected, const OdometrySettings& settings,
                               std::mt19937_64& random, std::span<const StereoCorrespondence> static_points) {
  MotionEstimate result;
  result.T_previous_current.pose = expected.T_previous_current;
  result.is_inlier.assign(points.size(), 0);
  const auto required = static_cast<std::size_t>(std::max(3, settings.min_inliers));
  if (points.size() < required) return result;

  std::vector<StereoCorrespondence> all(points.begin(), points.end());
  all.insert(all.end(), static_points.begin(), static_points.end());
  const TwoViewAdjustment rough(all, camera, expected.T_previous_current, settings.pixel_sigma_px,
                                /*own_noise=*/false);
  Pose pose = ransac({all, rough, expected}, settings.ransac_iterations, random);
  result.surprising = expected.surprised_by(pose);

  constexpr int kReselections = 2;
  std::optional<PoseGaussian> solution;
  for (int round = 0; round < kReselections; ++round) {
    result.is_inlier = agreement(points, camera, pose, settings);
    result.inlier_count = static_cast<int>(std::count(result.is_inlier.begin(), result.is_inlier.end(), 1));
    if (result.inlier_count < static_cast<int>(required)) return result;
    solution = TwoViewAdjustment(points, camera, pose, settings.pixel_sigma_px).solve(pose, result.is_inlier);
    if (!solution) return result;
    pose = solution->pose;
  }

  result.T_previous_current = *solution;
  result.valid = well_posed(solution->covariance);
  return result;
}

}  // namespace stereo_slam
