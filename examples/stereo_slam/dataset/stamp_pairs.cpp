// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/stamp_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/stamps/stamp_units.hpp"

namespace stereo_slam {
namespace {

/// The index of the stamp nearest to another one; of two as near, the earlier.
std::size_t nearest_to(const std::vector<std::int64_t>& stamps_ns, std::int64_t stamp_ns) {
  const auto after = std::ranges::lower_bound(stamps_ns, stamp_ns);
  const auto index = static_cast<std::size_t>(after - stamps_ns.begin());
  if (index == 0) return 0;
  if (index == stamps_ns.size()) return index - 1;
  return *after - stamp_ns < stamp_ns - stamps_ns[index - 1] ? index : index - 1;
}

/// The largest distance that is less than half the time between images; of single images, any.
std::int64_t below_half_interval(const std::vector<std::int64_t>& left_ns,
                                 const std::vector<std::int64_t>& right_ns) {
  std::int64_t interval_ns = std::numeric_limits<std::int64_t>::max();
  for (const auto* stamps_ns : {&left_ns, &right_ns}) {
    const std::int64_t usual_ns = usual_interval_ns(*stamps_ns);
    if (usual_ns > 0) interval_ns = std::min(interval_ns, usual_ns);
  }
  return (interval_ns - 1) / 2;
}

PairDistances distances_of(std::vector<double> apart_ns) {
  if (apart_ns.empty()) return {};
  const double largest_ns = *std::ranges::max_element(apart_ns);
  return {.median_ns = std::llround(median(std::move(apart_ns))), .largest_ns = std::llround(largest_ns)};
}

}  // namespace

StampPairs pair_stamps(const std::vector<std::int64_t>& left_ns, const std::vector<std::int64_t>& right_ns,
                       std::optional<std::int64_t> most_apart_ns) {
  StampPairs result;
  const std::int64_t bound_ns = most_apart_ns.value_or(below_half_interval(left_ns, right_ns));
  result.most_apart_ms = 1e-6 * static_cast<double>(bound_ns);
  result.nearest_ns = std::numeric_limits<std::int64_t>::max();
  std::vector<char> right_paired(right_ns.size(), 0);
  std::vector<double> apart_ns;
  for (std::size_t i = 0; i < left_ns.size(); ++i) {
    if (right_ns.empty()) {
      result.left_alone.push_back(i);
      continue;
    }
    const std::size_t j = nearest_to(right_ns, left_ns[i]);
    const std::int64_t distance_ns = std::abs(left_ns[i] - right_ns[j]);
    result.nearest_ns = std::min(result.nearest_ns, distance_ns);
    if (distance_ns > bound_ns || nearest_to(left_ns, right_ns[j]) != i) {
      result.left_alone.push_back(i);
      continue;
    }
    result.pairs.emplace_back(i, j);
    right_paired[j] = 1;
    apart_ns.push_back(static_cast<double>(distance_ns));
  }
  for (std::size_t j = 0; j < right_ns.size(); ++j) {
    if (right_paired[j] == 0) result.right_alone.push_back(j);
  }
  result.distances = distances_of(std::move(apart_ns));
  return result;
}

StampPairs paired_by_stamps(const CameraStamps& left, const CameraStamps& right,
                            const PairingOptions& options, SequenceScan& scan) {
  constexpr std::int64_t kNoted_ns = 1'000'000;  // more than messages and triggers take
  StampPairs result = pair_stamps(left.stamps_ns, right.stamps_ns, options.most_apart_ns);
  if (left.stamps_ns.size() < 2 && right.stamps_ns.size() < 2) {
    fail(scan.sequence.folder, "has {} of {} and {} of {}; a recording has two pairs of images or more",
         counted(left.stamps_ns.size(), "image"), left.name, counted(right.stamps_ns.size(), "image"),
         right.name);
  }
  if (result.pairs.size() < 2) {
    fail(scan.sequence.folder,
         "{} of {} images of {} and {} of {} were taken within {:.4g} ms of each other, and the nearest are "
         "{:.6g} s apart; both cameras need a common clock, and images of the same time",
         result.pairs.size(), left.stamps_ns.size(), left.name, right.stamps_ns.size(), right.name,
         result.most_apart_ms, 1e-9 * static_cast<double>(result.nearest_ns));
  }
  scan.sequence.pair_distances = result.distances;
  const auto [median_ns, largest_ns] = result.distances;
  if (largest_ns <= kNoted_ns) return result;
  scan.warn(
      scan.sequence.folder,
      "by their stamps, the images of a pair were taken up to {:.3g} ms apart (median {:.3g} ms), which "
      "makes fast motion inaccurate; --max-pair-distance-ms leaves out pairs further apart than it says",
      1e-6 * static_cast<double>(largest_ns), 1e-6 * static_cast<double>(median_ns));
  return result;
}

void warn_of_lone_images(const CameraStamps& left, const CameraStamps& right, const StampPairs& pairs,
                         SequenceScan& scan) {
  if (pairs.left_alone.empty() && pairs.right_alone.empty()) return;
  scan.warn(scan.sequence.folder,
            "{} of {} images of {} and {} of {} of {} have no partner within {:.4g} ms; they are left out",
            pairs.left_alone.size(), left.stamps_ns.size(), left.name, pairs.right_alone.size(),
            right.stamps_ns.size(), right.name, pairs.most_apart_ms);
}

}  // namespace stereo_slam
