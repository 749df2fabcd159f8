// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/evaluation/pose_matching.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

/// Scores of an estimated trajectory against the ground truth. Everywhere, truth[i] and estimate[i] belong to
/// the same instant.
namespace stereo_slam {

using PoseSpan = std::span<const Eigen::Isometry3d>;

/// Path length from the first pose to each, in m.
[[nodiscard]] std::vector<double> distances_along(PoseSpan poses);

/// Length of the estimated path, divided by that of the true path. Nothing when the true length is zero, or
/// without poses.
[[nodiscard]] std::optional<double> path_ratio(PoseSpan truth, PoseSpan estimate);

/// Segment lengths of the KITTI odometry benchmark, and shorter ones for short paths.
inline constexpr std::array kKittiLengths_m = {100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0};
inline constexpr std::array kShortLengths_m = {10.0, 20.0, 30.0, 40.0, 50.0};

/// The KITTI odometry benchmark's score. Segments start at every 10th frame and have the given lengths
/// along the ground truth; a segment ends at the first frame further than that from its start. The error of a
/// segment is inverse(delta_estimate) * delta_truth, divided by the nominal length; the scores are averages
/// over all segments of all lengths. No alignment. Matrices are inverted as in the benchmark's
/// own program.
struct KittiScore {
  double t_rel_percent = 0.0;
  double r_rel_deg_per_100m = 0.0;
  std::size_t segments = 0;
};

/// Nothing when the ground truth is shorter than one segment. `lengths_m` increase.
[[nodiscard]] std::optional<KittiScore> kitti_score(PoseSpan truth, PoseSpan estimate,
                                                    std::span<const double> lengths_m = kKittiLengths_m);

/// Statistics of errors >= 0.
struct ErrorStatistics {
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double max = 0.0;
  std::size_t count = 0;
};

/// Throws std::invalid_argument if `errors` is empty.
[[nodiscard]] ErrorStatistics error_statistics(std::vector<double> errors);

/// The rigid motion T minimising sum |truth_i - T estimate_i|^2 over the positions, without scale: Umeyama,
/// "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991.
[[nodiscard]] Eigen::Isometry3d align(PoseSpan truth, PoseSpan estimate);

/// The similarity x -> scale * R * x + t minimising the same sum. A scale error of the estimate shows in
/// `scale` and not in the residuals.
struct Similarity {
  double scale = 1.0;  ///< of the truth relative to the estimate
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
};

/// Nothing when the positions of either trajectory are all the same, because the scale is undetermined then.
/// Two positions are always aligned without an error.
[[nodiscard]] std::optional<Similarity> align_with_scale(PoseSpan truth, PoseSpan estimate);

/// Distances between true and estimated positions after T_truth_estimate, in metres (ATE; evo: APE).
[[nodiscard]] ErrorStatistics absolute_trajectory_error(PoseSpan truth, PoseSpan estimate,
                                                        const Eigen::Affine3d& T_truth_estimate);

/// ATE after align_with_scale, and the scale that it found.
struct SimilarityAlignedError {
  double scale = 1.0;
  ErrorStatistics ate_m;
};

/// Nothing where align_with_scale returns nothing.
[[nodiscard]] std::optional<SimilarityAlignedError> similarity_aligned_error(PoseSpan truth,
                                                                             PoseSpan estimate);

/// Relative pose error (RPE) as in the TUM benchmark and evo: errors of the motion between given pairs of
/// frames. Unlike in KITTI's score, the errors are not divided by the length.
struct RelativePoseError {
  ErrorStatistics translation_m;
  ErrorStatistics rotation_deg;
};

/// (0, 1), (1, 2) ... up to `count` frames.
[[nodiscard]] FramePairs consecutive_pairs(std::size_t count);

/// Pairs of frames that are consecutive and at least `length_m` apart along `poses`. As in evo, the first
/// pair begins after the first `length_m`, and `poses` is the estimate.
[[nodiscard]] FramePairs pairs_by_distance(PoseSpan poses, double length_m);

/// Nothing without pairs.
[[nodiscard]] std::optional<RelativePoseError> relative_pose_error(PoseSpan truth, PoseSpan estimate,
                                                                   const FramePairs& pairs);

/// All scores of one estimate.
struct Evaluation {
  std::size_t truth_poses = 0;
  std::size_t estimate_poses = 0;
  std::size_t matched = 0;
  double truth_length_m = 0.0;       ///< of the matched part
  double estimate_length_m = 0.0;    ///< of the matched part
  std::optional<double> path_ratio;  ///< estimated length / true length
  std::optional<KittiScore> kitti;
  std::optional<KittiScore> segments_10_50_m;
  ErrorStatistics ate_aligned_m;  ///< SE(3)-aligned
  std::optional<SimilarityAlignedError> similarity_aligned;
  ErrorStatistics ate_first_pose_m;  ///< aligned by the first pose
  std::optional<RelativePoseError> rpe_frame;
  std::optional<RelativePoseError> rpe_10m;
};

/// Matches the poses and scores them.
[[nodiscard]] Evaluation evaluate(const Trajectory& truth, const Trajectory& estimate,
                                  double max_difference_s = 0.01);

/// As text.
void print_evaluation(std::ostream& stream, const Evaluation& evaluation);

/// As a JSON object; scores that do not exist are null. `more` has further members, "name": value, or is
/// empty.
void write_evaluation_json(std::ostream& stream, const Evaluation& evaluation, const std::string& more = "");

}  // namespace stereo_slam
