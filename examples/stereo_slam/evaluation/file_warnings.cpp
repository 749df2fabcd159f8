// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/file_warnings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/evaluation/clock_offset.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/evaluation/pose_conventions.hpp"
#include "stereo_slam/evaluation/pose_jumps.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

using Warning = std::optional<std::string>;

[[nodiscard]] Warning different_lengths(const TrajectoryFile& truth, const TrajectoryFile& estimate) {
  const auto& [truth_file, a] = truth;
  const auto& [estimate_file, b] = estimate;
  if (!a.stamps_ns.empty() || !b.stamps_ns.empty() || !a.frames.empty() || !b.frames.empty()) return {};
  if (a.poses.size() == b.poses.size()) return {};
  return fmt::format(
      "{} ground-truth and {} estimated poses without stamps, in {} and {}; they are paired from the first "
      "one on",
      a.poses.size(), b.poses.size(), truth_file.string(), estimate_file.string());
}

/// A difference of the units, or of the clocks, may leave a few poses that match by chance.
[[nodiscard]] Warning few_matches(const Trajectory& truth, const Trajectory& estimate, std::size_t matched) {
  if (2 * matched >= std::min(truth.poses.size(), estimate.poses.size())) return {};
  return fmt::format("only {} of {} ground-truth and {} estimated poses match; {}", matched,
                     truth.poses.size(), estimate.poses.size(), describe_ranges(truth, estimate));
}

/// Other programs write a stamp twice now and then, with two poses that differ little.
[[nodiscard]] Warning repeated_stamps(const TrajectoryFile& file) {
  constexpr double kAlike_m = 0.05;
  const auto& [name, trajectory] = file;
  std::size_t count = 0;
  for (std::size_t i = 1; i < trajectory.stamps_ns.size(); ++i) {
    const double apart_m = (trajectory.poses[i].translation() - trajectory.poses[i - 1].translation()).norm();
    if (trajectory.stamps_ns[i] == trajectory.stamps_ns[i - 1] && !(apart_m <= kAlike_m)) ++count;
  }
  if (count == 0) return {};
  return fmt::format("{}: {} the stamp of the pose before, more than {} m away; one of the two is not used",
                     name.string(), counted(count, "pose has", "poses have"), kAlike_m);
}

[[nodiscard]] Warning same_poses(const PosePairs& poses) {
  const bool same = std::ranges::equal(poses.truth, poses.estimate,
                                       [](const auto& a, const auto& b) { return a.matrix() == b.matrix(); });
  if (!same) return {};
  return "the estimate has exactly the poses of the ground truth; check that it is not the same file";
}

/// Whether all rotations are the same, to the digits of a file.
[[nodiscard]] bool never_turns(const std::vector<Eigen::Isometry3d>& poses, double limit_rad) {
  return std::ranges::all_of(poses, [&](const Eigen::Isometry3d& pose) {
    const Eigen::Matrix3d turn = poses.front().linear().transpose() * pose.linear();
    return Eigen::AngleAxisd(Eigen::Quaterniond(turn).normalized()).angle() <= limit_rad;
  });
}

[[nodiscard]] Warning without_rotations(const PosePairs& poses) {
  constexpr double kSame_rad = 1e-6;
  constexpr double kTurned_rad = 0.1;
  const auto text = [](std::string_view file, std::string_view other) {
    return fmt::format(
        "the rotations of the {} are all the same, and those of the {} are not: RPE, the errors of segments "
        "and NEES mean nothing, only the ATE does",
        file, other);
  };
  if (never_turns(poses.truth, kSame_rad) && !never_turns(poses.estimate, kTurned_rad))
    return text("ground truth", "estimate");
  if (never_turns(poses.estimate, kSame_rad) && !never_turns(poses.truth, kTurned_rad))
    return text("estimate", "ground truth");
  return {};
}

[[nodiscard]] Warning other_scale(const PosePairs& poses) {
  constexpr double kLeast = 0.05;  // more than the errors of a calibration
  constexpr double kClearly = 3.0;
  const auto scaled = similarity_aligned_error(poses.truth, poses.estimate);
  if (!scaled || poses.truth.size() <= 3 || std::abs(scaled->scale - 1.0) < kLeast) return {};
  const double rmse_m =
      absolute_trajectory_error(poses.truth, poses.estimate, align(poses.truth, poses.estimate)).rmse;
  if (!(kClearly * scaled->ate_m.rmse < rmse_m)) return {};
  return fmt::format(
      "the estimate has another scale than the ground truth: after scaling by {:.4g}, the ATE is {:.3g} m in "
      "place of {:.3g} m; check its unit, the baseline of the calibration, or whether it is of a single "
      "camera",
      scaled->scale, scaled->ate_m.rmse, rmse_m);
}

/// "the pose at 0.7 s", "the pose of frame 7".
[[nodiscard]] std::string pose_name(const Trajectory& trajectory, std::size_t pose) {
  if (!trajectory.stamps_ns.empty())
    return fmt::format("the pose at {} s", format_seconds(trajectory.stamps_ns[pose]));
  return fmt::format("the pose of frame {}",
                     trajectory.frames.empty() ? static_cast<std::int64_t>(pose) : trajectory.frames[pose]);
}

/// `pose_of` tells which pose of the file a pair has.
template <class PoseOf>
[[nodiscard]] Warning jumping(const TrajectoryFile& file, const std::vector<PoseJump>& jumps,
                              std::string_view other, const PoseOf& pose_of) {
  if (jumps.empty()) return {};
  const PoseJump& first = jumps.front();
  const std::string more =
      jumps.size() == 1 ? "" : fmt::format(", and {} more jump like it", jumps.size() - 1);
  return fmt::format(
      "{}: {} is {:.3g} m away from the one before, while the {} moves by {:.3g} m{}; remove the poses of "
      "a body that was lost, which are often written as zeros or as the last one",
      file.file.string(), pose_name(file.trajectory, pose_of(first.pair)), first.length_m, other,
      first.expected_m, more);
}

/// The motions of both files under the clocks that fit best.
struct MatchedMotions {
  PosePairs poses;
  Warning clocks;
};

[[nodiscard]] MatchedMotions motions_under_best_clocks(const Trajectory& truth, const Trajectory& estimate,
                                                       PosePairs poses) {
  const auto offset = find_clock_offset(truth, estimate);
  if (!offset) return {std::move(poses), {}};
  std::string text = describe(*offset, truth, estimate, poses);
  return {poses_after(*offset, truth, estimate), std::move(text)};
}

}  // namespace

std::vector<std::string> file_warnings(const TrajectoryFile& truth, const TrajectoryFile& estimate,
                                       const FramePairs& pairs) {
  std::vector<std::string> warnings;
  for (const auto* file : {&truth, &estimate}) {
    for (const auto& remark : file->trajectory.remarks)
      warnings.push_back(fmt::format("{}: {}", file->file.string(), remark));
  }
  const PosePairs matched = poses_of_pairs(truth.trajectory, estimate.trajectory, pairs);
  const PoseJumps jumps = find_jumps(matched);
  const auto [poses, clocks] = motions_under_best_clocks(truth.trajectory, estimate.trajectory, matched);
  const Warning unturned = without_rotations(poses);
  const auto conventions = unturned ? std::nullopt : find_conventions(poses);
  for (const Warning& warning :
       {different_lengths(truth, estimate), repeated_stamps(truth), repeated_stamps(estimate),
        few_matches(truth.trajectory, estimate.trajectory, pairs.size()), same_poses(matched),
        jumping(truth, jumps.truth, "estimate", [&](std::size_t pair) { return pairs[pair].first; }),
        jumping(estimate, jumps.estimate, "ground truth",
                [&](std::size_t pair) { return pairs[pair].second; }),
        clocks, unturned, other_scale(conventions ? corrected(poses, conventions->better) : poses),
        conventions ? Warning(describe(*conventions)) : Warning()}) {
    if (warning) warnings.push_back(*warning);
  }
  return warnings;
}

}  // namespace stereo_slam
