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
         is_positive_definite(covariance);
}

[[nodiscard]] std::vector<std::uint8_t> flag_inliers(const std::vector<double>& distance2) {
  std::vector<std::uint8_t> is_inlier(distance2.size());
  std::transform(distance2.begin(), distance2.end(), is_inlier.begin(),
                 [](double d) { return static_cast<std::uint8_t>(d < kChi2_3_99); });
  return is_inlier;
}

/// A motion, and the correspondences that agree with it.
struct Hypothesis {
  Pose pose;
  double cost = std::numeric_limits<double>::infinity();  ///< sum of truncated distances
  std::size_t inlier_count = 0;

  /// Becomes the other one if that is better.
  void compete(const Hypothesis& other) {
    if (other.cost < cost) *this = other;
  }
};

[[nodiscard]] Hypothesis judge(const TwoViewAdjustment& adjustment, const Pose& pose) {
  Hypothesis result{pose, 0.0, 0};
  for (const double d : adjustment.squared_distances(pose)) {
    result.cost += std::min(d, kChi2_3_99);
    if (d < kChi2_3_99) ++result.inlier_count;
  }
  return result;
}

/// Whether at least `least` correspondences agree with the first pose, and `majority` times as many as with
/// the second. Correspondences that agree with both are not counted: far points agree with many motions.
[[nodiscard]] bool outvotes(const TwoViewAdjustment& adjustment, const std::pair<Pose, Pose>& pose_and_other,
                            std::size_t majority, std::size_t least) {
  const auto agree = flag_inliers(adjustment.squared_distances(pose_and_other.first));
  const auto agree_with_other = flag_inliers(adjustment.squared_distances(pose_and_other.second));
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
[[nodiscard]] Pose ransac(const TwoViewAdjustment& adjustment, std::size_t count,
                          const ExpectedMotion& expected, const OdometrySettings& settings,
                          std::mt19937_64& random) {
  const Pose& initial = expected.T_previous_current;
  Hypothesis best = judge(adjustment, initial);
  Hypothesis best_continuing = best;
  for (int iteration = 0; iteration < settings.ransac_iterations; ++iteration) {
    const double share = static_cast<double>(best.inlier_count) / static_cast<double>(count);
    if (iteration >= sufficient_draws(share) && continues(best.pose, initial)) break;
    const auto pose = adjustment.minimal_solution(draw_three(count, random), initial);
    if (!pose) continue;
    const Hypothesis drawn = judge(adjustment, *pose);
    best.compete(drawn);
    if (continues(*pose, initial)) best_continuing.compete(drawn);
  }
  if (continues(best.pose, initial)) return best.pose;
  const std::size_t majority = expected.expectation == Expectation::kDoubtful ? 1 : 4;
  const int least = expected.expectation == Expectation::kSteady ? 2 * std::max(0, settings.min_inliers) : 0;
  const bool jerk =
      outvotes(adjustment, {best.pose, best_continuing.pose}, majority, static_cast<std::size_t>(least));
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

std::vector<std::uint8_t> agreement(std::span<const StereoCorrespondence> points, const StereoCamera& camera,
                                    const Pose& motion, const OdometrySettings& settings) {
  const auto noise = [R = stereo_pixel_covariance(settings.pixel_sigma_px)](const StereoCorrespondence&) {
    return R;
  };
  return flag_inliers(TwoViewAdjustment(points, camera, motion, noise).squared_distances(motion));
}

MotionEstimate estimate_motion(const MotionCorrespondences& correspondences, const StereoCamera& camera,
                               const ExpectedMotion& expected, const OdometrySettings& settings,
                               std::mt19937_64& random) {
  const auto& [points, static_points] = correspondences;
  MotionEstimate result;
  result.T_previous_current.pose = expected.T_previous_current;
  result.is_inlier.assign(points.size(), 0);
  const auto required = static_cast<std::size_t>(std::max(3, settings.min_inliers));
  if (points.size() < required) return result;

  const TwoViewAdjustment::NoiseOf equal_noise = [&settings](const StereoCorrespondence&) {
    return stereo_pixel_covariance(settings.pixel_sigma_px);
  };
  const TwoViewAdjustment::NoiseOf own_noise = [&equal_noise](const StereoCorrespondence& c) {
    return c.R ? *c.R : equal_noise(c);
  };
  std::vector<StereoCorrespondence> voters(points.begin(), points.end());
  voters.insert(voters.end(), static_points.begin(), static_points.end());
  const TwoViewAdjustment rough(voters, camera, expected.T_previous_current, equal_noise);
  Pose pose = ransac(rough, voters.size(), expected, settings, random);
  result.jerk =
      expected.expectation != Expectation::kNoMotion && !continues(pose, expected.T_previous_current);

  constexpr int kReselections = 2;
  std::optional<PoseGaussian> solution;
  for (int round = 0; round < kReselections; ++round) {
    result.is_inlier = agreement(points, camera, pose, settings);
    result.inlier_count = static_cast<int>(std::count(result.is_inlier.begin(), result.is_inlier.end(), 1));
    if (result.inlier_count < static_cast<int>(required)) return result;
    solution = TwoViewAdjustment(points, camera, pose, own_noise).solve(pose, result.is_inlier);
    if (!solution) return result;
    pose = solution->pose;
  }

  result.T_previous_current = *solution;
  result.valid = well_posed(solution->covariance);
  return result;
}

}  // namespace stereo_slam
