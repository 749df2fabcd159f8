// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/pose_matching.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <stdexcept>

#include <fmt/format.h>

#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

template <class Range>
std::size_t nearest_index(const Range& stamps, std::int64_t stamp) {
  const auto after = std::ranges::lower_bound(stamps, stamp);
  if (after == stamps.begin()) return 0;
  const auto before = after - 1;
  const bool take_before = after == stamps.end() || stamp - *before <= *after - stamp;
  return static_cast<std::size_t>((take_before ? before : after) - stamps.begin());
}

/// The number of each pose's frame.
std::vector<std::int64_t> frame_numbers(const Trajectory& trajectory) {
  if (!trajectory.frames.empty()) return trajectory.frames;
  std::vector<std::int64_t> numbers(trajectory.poses.size());
  std::iota(numbers.begin(), numbers.end(), std::int64_t{0});
  return numbers;
}

/// The time from the end of the earlier trajectory to the beginning of the later one; not positive if they
/// overlap.
[[nodiscard]] std::int64_t gap_ns(const Trajectory& truth, const Trajectory& estimate) {
  return std::max(truth.stamps_ns.front(), estimate.stamps_ns.front()) -
         std::min(truth.stamps_ns.back(), estimate.stamps_ns.back());
}

/// "FIRST to LAST", in seconds or frames.
[[nodiscard]] std::string range_text(const Trajectory& trajectory) {
  if (trajectory.poses.empty()) return "none";
  if (!trajectory.stamps_ns.empty()) {
    return fmt::format("{} to {} s", format_seconds(trajectory.stamps_ns.front()),
                       format_seconds(trajectory.stamps_ns.back()));
  }
  const auto frames = frame_numbers(trajectory);
  return fmt::format("frames {} to {}", frames.front(), frames.back());
}

/// How far apart the stamps of trajectories are that overlap.
[[nodiscard]] std::string nearest_text(const Trajectory& truth, const Trajectory& estimate,
                                       double max_difference_s) {
  if (truth.stamps_ns.empty() || estimate.stamps_ns.empty()) return "";
  std::int64_t nearest_ns = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t stamp_ns : estimate.stamps_ns) {
    const std::int64_t other_ns = truth.stamps_ns[nearest_index(truth.stamps_ns, stamp_ns)];
    nearest_ns = std::min(nearest_ns, std::abs(other_ns - stamp_ns));
  }
  if (nearest_ns <= std::llround(max_difference_s * 1e9) || gap_ns(truth, estimate) > 0) return "";
  return fmt::format(
      "; the nearest stamps are {} s apart, and --max-time-difference is {:.4g} s: check both clocks",
      format_seconds(nearest_ns), max_difference_s);
}

}  // namespace

FramePairs associate_by_stamp(std::span<const std::int64_t> truth_ns,
                              std::span<const std::int64_t> estimate_ns, std::int64_t max_difference_ns) {
  const bool truth_is_shorter = truth_ns.size() < estimate_ns.size();
  const auto shorter = truth_is_shorter ? truth_ns : estimate_ns;
  const auto longer = truth_is_shorter ? estimate_ns : truth_ns;
  FramePairs pairs;
  if (longer.empty()) return pairs;
  for (std::size_t i = 0; i < shorter.size(); ++i) {
    const std::size_t j = nearest_index(longer, shorter[i]);
    if (std::abs(longer[j] - shorter[i]) > max_difference_ns) continue;
    pairs.emplace_back(truth_is_shorter ? i : j, truth_is_shorter ? j : i);
  }
  return pairs;
}

FramePairs match_poses(const Trajectory& truth, const Trajectory& estimate, double max_difference_s) {
  if (truth.stamps_ns.empty() != estimate.stamps_ns.empty()) {
    throw std::runtime_error(
        "only one of the two trajectories has stamps, so their poses cannot be matched; give both with "
        "stamps or both in KITTI format");
  }
  FramePairs pairs;
  if (truth.stamps_ns.empty()) {
    pairs = associate_by_stamp(frame_numbers(truth), frame_numbers(estimate), 0);
  } else {
    pairs = associate_by_stamp(truth.stamps_ns, estimate.stamps_ns, std::llround(max_difference_s * 1e9));
  }
  if (pairs.size() < 3) {
    throw std::runtime_error(
        fmt::format("only {} of {} estimated poses match one of {} ground-truth poses, 3 are needed; {}{}",
                    pairs.size(), estimate.poses.size(), truth.poses.size(), describe_ranges(truth, estimate),
                    nearest_text(truth, estimate, max_difference_s)));
  }
  return pairs;
}

PosePairs poses_of_pairs(const Trajectory& truth, const Trajectory& estimate, const FramePairs& pairs) {
  PosePairs poses;
  for (const auto& [i, j] : pairs) {
    poses.truth.push_back(truth.poses[i]);
    poses.estimate.push_back(estimate.poses[j]);
  }
  return poses;
}

std::string describe_ranges(const Trajectory& truth, const Trajectory& estimate) {
  std::string text = fmt::format("ground truth: {}, estimate: {}", range_text(truth), range_text(estimate));
  if (truth.stamps_ns.empty() || estimate.stamps_ns.empty()) return text;
  const std::int64_t apart_ns = gap_ns(truth, estimate);
  if (apart_ns > 0) text += fmt::format(", which is {} s apart", format_seconds(apart_ns));
  return text;
}

}  // namespace stereo_slam
