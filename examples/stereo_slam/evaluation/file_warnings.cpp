// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/file_warnings.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/evaluation/pose_conventions.hpp"
#include "stereo_slam/io/counted.hpp"

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

}  // namespace

std::vector<std::string> file_warnings(const TrajectoryFile& truth, const TrajectoryFile& estimate,
                                       const FramePairs& pairs) {
  std::vector<std::string> warnings;
  for (const auto* file : {&truth, &estimate}) {
    for (const auto& remark : file->trajectory.remarks)
      warnings.push_back(fmt::format("{}: {}", file->file.string(), remark));
  }
  const PosePairs poses = poses_of_pairs(truth.trajectory, estimate.trajectory, pairs);
  const Warning unturned = without_rotations(poses);
  const auto conventions = unturned ? std::nullopt : find_conventions(poses);
  for (const Warning& warning :
       {different_lengths(truth, estimate), repeated_stamps(truth), repeated_stamps(estimate),
        few_matches(truth.trajectory, estimate.trajectory, pairs.size()), same_poses(poses), unturned,
        other_scale(conventions ? corrected(poses, conventions->better) : poses),
        conventions ? Warning(describe(*conventions)) : Warning()}) {
    if (warning) warnings.push_back(*warning);
  }
  return warnings;
}

}  // namespace stereo_slam
