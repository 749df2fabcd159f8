// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/evaluation/json_value.hpp"

namespace stereo_slam {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr std::size_t kSegmentStep = 10;

/// Angle of a rotation, rad. Unlike the arc cosine of the trace, it is accurate for small angles.
double rotation_angle(const Eigen::Isometry3d& motion) {
  return Eigen::AngleAxisd(Eigen::Quaterniond(motion.linear()).normalized()).angle();
}

/// inverse(delta_estimate) * delta_truth between two frames.
Eigen::Isometry3d motion_error(PoseSpan truth, PoseSpan estimate, std::size_t from, std::size_t to) {
  const Eigen::Isometry3d delta_truth = truth[from].inverse(Eigen::Affine) * truth[to];
  const Eigen::Isometry3d delta_estimate = estimate[from].inverse(Eigen::Affine) * estimate[to];
  return delta_estimate.inverse(Eigen::Affine) * delta_truth;
}

Eigen::Matrix3Xd positions(PoseSpan poses) {
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i)
    points.col(static_cast<Eigen::Index>(i)) = poses[i].translation();
  return points;
}

/// Whether all positions are the same, to the rounding of their mean.
bool stands_still(const Eigen::Matrix3Xd& points) {
  constexpr double kLeast_m = 1e-100;  // squares of smaller numbers may underflow
  const double spread = (points.colwise() - points.rowwise().mean()).cwiseAbs().maxCoeff();
  return spread <=
         std::max(kLeast_m, 1e-14 * static_cast<double>(points.cols()) * points.cwiseAbs().maxCoeff());
}

}  // namespace

std::vector<double> distances_along(PoseSpan poses) {
  std::vector<double> distances(poses.size(), 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    distances[i] = distances[i - 1] + (poses[i].translation() - poses[i - 1].translation()).norm();
  }
  return distances;
}

std::optional<double> path_ratio(PoseSpan truth, PoseSpan estimate) {
  if (truth.empty() || estimate.empty()) return std::nullopt;
  const double truth_m = distances_along(truth).back();
  if (truth_m == 0.0) return std::nullopt;
  return distances_along(estimate).back() / truth_m;
}

std::optional<KittiScore> kitti_score(PoseSpan truth, PoseSpan estimate, std::span<const double> lengths_m) {
  const auto distances = distances_along(truth);
  double translation_sum = 0.0;  // m per m
  double rotation_sum = 0.0;     // rad per m
  KittiScore score;
  for (std::size_t first = 0; first < truth.size(); first += kSegmentStep) {
    for (const double length_m : lengths_m) {
      const auto end = std::ranges::upper_bound(distances, distances[first] + length_m);
      if (end == distances.end()) break;
      const auto last = static_cast<std::size_t>(end - distances.begin());
      const Eigen::Isometry3d error = motion_error(truth, estimate, first, last);
      translation_sum += error.translation().norm() / length_m;
      rotation_sum += rotation_angle(error) / length_m;
      ++score.segments;
    }
  }
  if (score.segments == 0) return std::nullopt;
  const auto count = static_cast<double>(score.segments);
  score.t_rel_percent = 100.0 * translation_sum / count;
  score.r_rel_deg_per_100m = 100.0 * kDegrees * rotation_sum / count;
  return score;
}

ErrorStatistics error_statistics(std::vector<double> errors) {
  if (errors.empty()) throw std::invalid_argument("error_statistics: no errors");
  const auto count = static_cast<double>(errors.size());
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  const double upper = *middle;
  const double lower = errors.size() % 2 == 1 ? upper : *std::max_element(errors.begin(), middle);
  return {.rmse = std::sqrt(std::inner_product(errors.begin(), errors.end(), errors.begin(), 0.0) / count),
          .mean = std::accumulate(errors.begin(), errors.end(), 0.0) / count,
          .median = 0.5 * (lower + upper),
          .max = *std::ranges::max_element(errors),
          .count = errors.size()};
}

Eigen::Isometry3d align(PoseSpan truth, PoseSpan estimate) {
  return Eigen::Isometry3d(Eigen::umeyama(positions(estimate), positions(truth), /*with_scaling=*/false));
}

std::optional<Similarity> align_with_scale(PoseSpan truth, PoseSpan estimate) {
  const Eigen::Matrix3Xd to = positions(truth);
  const Eigen::Matrix3Xd from = positions(estimate);
  if (stands_still(to) || stands_still(from)) return std::nullopt;
  const Eigen::Affine3d transform(Eigen::umeyama(from, to, /*with_scaling=*/true));
  return Similarity{std::cbrt(transform.linear().determinant()), transform};
}

ErrorStatistics absolute_trajectory_error(PoseSpan truth, PoseSpan estimate,
                                          const Eigen::Affine3d& T_truth_estimate) {
  std::vector<double> errors(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    errors[i] = (T_truth_estimate * estimate[i].translation() - truth[i].translation()).norm();
  }
  return error_statistics(std::move(errors));
}

std::optional<SimilarityAlignedError> similarity_aligned_error(PoseSpan truth, PoseSpan estimate) {
  const auto similarity = align_with_scale(truth, estimate);
  if (!similarity) return std::nullopt;
  return SimilarityAlignedError{similarity->scale,
                                absolute_trajectory_error(truth, estimate, similarity->transform)};
}

FramePairs consecutive_pairs(std::size_t count) {
  FramePairs pairs;
  for (std::size_t i = 1; i < count; ++i) pairs.emplace_back(i - 1, i);
  return pairs;
}

FramePairs pairs_by_distance(PoseSpan poses, double length_m) {
  const auto distances = distances_along(poses);
  std::vector<std::size_t> ends;
  double start_m = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (distances[i] - start_m < length_m) continue;
    ends.push_back(i);
    start_m = distances[i];
  }
  FramePairs pairs;
  for (std::size_t i = 1; i < ends.size(); ++i) pairs.emplace_back(ends[i - 1], ends[i]);
  return pairs;
}

std::optional<RelativePoseError> relative_pose_error(PoseSpan truth, PoseSpan estimate,
                                                     const FramePairs& pairs) {
  if (pairs.empty()) return std::nullopt;
  std::vector<double> translations_m;
  std::vector<double> rotations_deg;
  for (const auto& [from, to] : pairs) {
    const Eigen::Isometry3d error = motion_error(truth, estimate, from, to);
    translations_m.push_back(error.translation().norm());
    rotations_deg.push_back(kDegrees * rotation_angle(error));
  }
  return RelativePoseError{error_statistics(std::move(translations_m)),
                           error_statistics(std::move(rotations_deg))};
}

Evaluation evaluate(const Trajectory& truth, const Trajectory& estimate, double max_difference_s) {
  const auto [matched_truth, matched_estimate] =
      poses_of_pairs(truth, estimate, match_poses(truth, estimate, max_difference_s));
  const std::size_t matched = matched_truth.size();
  return {.truth_poses = truth.poses.size(),
          .estimate_poses = estimate.poses.size(),
          .matched = matched,
          .truth_length_m = distances_along(matched_truth).back(),
          .estimate_length_m = distances_along(matched_estimate).back(),
          .path_ratio = path_ratio(matched_truth, matched_estimate),
          .kitti = kitti_score(matched_truth, matched_estimate),
          .segments_10_50_m = kitti_score(matched_truth, matched_estimate, kShortLengths_m),
          .ate_aligned_m = absolute_trajectory_error(matched_truth, matched_estimate,
                                                     align(matched_truth, matched_estimate)),
          .similarity_aligned = similarity_aligned_error(matched_truth, matched_estimate),
          .ate_first_pose_m = absolute_trajectory_error(
              matched_truth, matched_estimate, matched_truth.front() * matched_estimate.front().inverse()),
          .rpe_frame = relative_pose_error(matched_truth, matched_estimate, consecutive_pairs(matched)),
          .rpe_10m = relative_pose_error(matched_truth, matched_estimate,
                                         pairs_by_distance(matched_estimate, 10.0))};
}

namespace {

void print_statistics(std::ostream& stream, std::string_view name, const ErrorStatistics& s,
                      std::string_view unit) {
  fmt::print(stream, "{:<32}rmse {:.6f}  mean {:.6f}  median {:.6f}  max {:.6f} {}\n", name, s.rmse, s.mean,
             s.median, s.max, unit);
}

void print_rpe(std::ostream& stream, std::string_view name, const std::optional<RelativePoseError>& rpe) {
  if (!rpe) {
    fmt::print(stream, "{:<32}n/a (the path is too short)\n", name);
    return;
  }
  print_statistics(stream, name, rpe->translation_m, "m");
  print_statistics(stream, "", rpe->rotation_deg, "deg");
}

std::string json(const ErrorStatistics& s) {
  return fmt::format(R"({{"rmse": {}, "mean": {}, "median": {}, "max": {}, "count": {}}})", s.rmse, s.mean,
                     s.median, s.max, s.count);
}

std::string json(const std::optional<RelativePoseError>& rpe) {
  if (!rpe) return "null";
  return fmt::format(R"({{"translation_m": {}, "rotation_deg": {}}})", json(rpe->translation_m),
                     json(rpe->rotation_deg));
}

void print_segments(std::ostream& stream, std::string_view name, double shortest_m,
                    const std::optional<KittiScore>& score) {
  if (!score) {
    fmt::print(stream, "{:<32}n/a (the path is shorter than {:.0f} m)\n", name, shortest_m);
    return;
  }
  fmt::print(stream, "{:<32}t_rel {:.4f} %  r_rel {:.4f} deg/100 m  ({} segments)\n", name,
             score->t_rel_percent, score->r_rel_deg_per_100m, score->segments);
}

void print_similarity(std::ostream& stream, const std::optional<SimilarityAlignedError>& error) {
  constexpr std::string_view kName = "ATE, similarity-aligned";
  if (!error) {
    fmt::print(stream, "{:<32}n/a (the camera stands still)\n", kName);
    return;
  }
  print_statistics(stream, kName, error->ate_m, fmt::format("m, after scaling by {:.5f}", error->scale));
}

std::string json(const std::optional<SimilarityAlignedError>& error) {
  if (!error) return "null";
  return fmt::format(R"({{"scale": {}, "ate_m": {}}})", error->scale, json(error->ate_m));
}

std::string json(const std::optional<KittiScore>& score) {
  if (!score) return "null";
  return fmt::format(R"({{"t_rel_percent": {}, "r_rel_deg_per_100m": {}, "segments": {}}})",
                     score->t_rel_percent, score->r_rel_deg_per_100m, score->segments);
}

}  // namespace

void print_evaluation(std::ostream& stream, const Evaluation& e) {
  fmt::print(stream, "frames matched                  {} ({} ground-truth, {} estimated poses)\n", e.matched,
             e.truth_poses, e.estimate_poses);
  fmt::print(stream, "path length                     {:.2f} m ground truth, {:.2f} m estimate, ratio {}\n",
             e.truth_length_m, e.estimate_length_m,
             e.path_ratio ? fmt::format("{:.5f}", *e.path_ratio) : "n/a (the camera stands still)");
  print_segments(stream, "KITTI, segments of 100-800 m", kKittiLengths_m.front(), e.kitti);
  print_segments(stream, "the same, segments of 10-50 m", kShortLengths_m.front(), e.segments_10_50_m);
  print_statistics(stream, "ATE, SE(3)-aligned", e.ate_aligned_m, "m");
  print_similarity(stream, e.similarity_aligned);
  print_statistics(stream, "ATE, first pose aligned", e.ate_first_pose_m, "m");
  print_rpe(stream, "RPE (TUM, evo), delta 1 frame", e.rpe_frame);
  print_rpe(stream, "RPE (TUM, evo), delta 10 m", e.rpe_10m);
}

void write_evaluation_json(std::ostream& stream, const Evaluation& e, const std::string& more) {
  fmt::print(stream,
             "{{\n  \"frames_matched\": {},\n  \"truth_poses\": {},\n  \"estimate_poses\": {},\n"
             "  \"truth_length_m\": {},\n  \"estimate_length_m\": {},\n"
             "  \"path_ratio\": {},\n  \"kitti\": {},\n  \"segments_10_50_m\": {},\n"
             "  \"ate_se3_aligned_m\": {},\n  \"similarity_aligned\": {},\n"
             "  \"ate_first_pose_aligned_m\": {},\n"
             "  \"rpe_1_frame\": {},\n  \"rpe_10_m\": {}{}\n}}\n",
             e.matched, e.truth_poses, e.estimate_poses, e.truth_length_m, e.estimate_length_m,
             json_value(e.path_ratio), json(e.kitti), json(e.segments_10_50_m), json(e.ate_aligned_m),
             json(e.similarity_aligned), json(e.ate_first_pose_m), json(e.rpe_frame), json(e.rpe_10m),
             more.empty() ? "" : ",\n  " + more);
}

}  // namespace stereo_slam
