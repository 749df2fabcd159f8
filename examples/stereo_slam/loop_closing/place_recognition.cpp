// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/place_recognition.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "stereo_slam/core/descriptor.hpp"

namespace stereo_slam {
namespace {

constexpr int kLeafSize = 48;       // descriptors at which a leaf is split
constexpr int kCandidates = 3;      // most that are verified at a keyframe
constexpr double kMinScore = 0.01;  // fraction of the points that voted for a candidate, weighted by rarity

constexpr std::size_t kNeighbours = 3;  // keyframes before and after that show the same place

[[gnu::always_inline]] inline void append_similar_by(const HalfDescriptor& half,
                                                     std::span<const TreeEntry> entries, int max_distance,
                                                     std::vector<std::uint32_t>& keyframes) {
  for (const TreeEntry& entry : entries) {
    if (differing_bits(entry.half, half) <= max_distance) keyframes.push_back(entry.keyframe);
  }
}

#ifdef __x86_64__
/// append_similar_by() with the popcnt instruction: several times as fast as the generic code.
[[gnu::target("popcnt")]] void append_similar_popcnt(const HalfDescriptor& half,
                                                     std::span<const TreeEntry> entries, int max_distance,
                                                     std::vector<std::uint32_t>& keyframes) {
  append_similar_by(half, entries, max_distance, keyframes);
}
#endif

/// Appends the keyframes of the entries that differ from `half` in at most `max_distance` bits.
void append_similar(const HalfDescriptor& half, std::span<const TreeEntry> entries, int max_distance,
                    std::vector<std::uint32_t>& keyframes) {
#ifdef __x86_64__
  static const bool has_popcnt = __builtin_cpu_supports("popcnt");
  if (has_popcnt) return append_similar_popcnt(half, entries, max_distance, keyframes);
#endif
  append_similar_by(half, entries, max_distance, keyframes);
}

/// Asks for a leaf that will be read soon: leaves lie anywhere in memory, and waiting for them would take
/// most of the time.
void prefetch(std::span<const TreeEntry> leaf) {
  constexpr std::size_t kCacheLine_bytes = 64;
  constexpr std::size_t kMost_bytes = 1024;  // the processor fetches the rest by itself
  const auto bytes = std::as_bytes(leaf);
  const std::size_t end = std::min(bytes.size(), kMost_bytes);
  for (std::size_t i = 0; i < end; i += kCacheLine_bytes) __builtin_prefetch(&bytes[i]);
}

/// The entries of keyframes below `end`: those of a leaf are in the order of their keyframes.
[[nodiscard]] std::span<const TreeEntry> older_than(std::size_t end, std::span<const TreeEntry> leaf) {
  while (!leaf.empty() && leaf.back().keyframe >= end) leaf = leaf.first(leaf.size() - 1);
  return leaf;
}

}  // namespace

PlaceRecognition::PlaceRecognition(const PlaceRecognitionSettings& settings) : settings_(settings) {
  for (int tree = 0; tree < settings.trees; ++tree) {
    const int half = tree % 2;
    const int trees_of_this_half = (settings.trees + 1 - half) / 2;
    trees_.emplace_back(half, tree / 2, trees_of_this_half, static_cast<std::size_t>(kLeafSize));
  }
}

void PlaceRecognition::add(std::size_t keyframe, std::span<const KeyframePoint> points) {
  for (auto& tree : trees_) tree.insert(points, static_cast<std::uint32_t>(keyframe));
}

PlaceQuery PlaceRecognition::query(std::span<const KeyframePoint> points, std::size_t end) const {
  constexpr std::size_t kAhead = 2;  // points whose leaves are on their way from memory
  PlaceQuery result;
  if (end == 0 || points.empty()) return result;
  std::vector<PlaceCandidate> all(end);
  for (std::size_t id = 0; id < end; ++id) all[id].keyframe = id;
  std::vector<std::vector<std::span<const TreeEntry>>> leaves;  // of each tree and point
  for (const auto& tree : trees_) leaves.push_back(tree.leaves_of(points));
  const double log_all = std::log(static_cast<double>(end) + 1.0);
  std::vector<std::uint32_t> found;  // keyframes with a point similar to this one
  for (std::size_t i = 0; i < points.size(); ++i) {
    found.clear();
    for (std::size_t t = 0; t < trees_.size(); ++t) {
      if (i + kAhead < points.size()) prefetch(leaves[t][i + kAhead]);
      const auto entries = older_than(end, leaves[t][i]);
      append_similar(trees_[t].half_of(points[i].descriptor), entries, settings_.max_descriptor_distance / 2,
                     found);
      result.comparisons += entries.size();
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    const double weight =
        1.0 - std::log(static_cast<double>(std::max<std::size_t>(found.size(), 1))) / log_all;
    for (const std::uint32_t id : found) {
      all[id].score += weight / static_cast<double>(points.size());
    }
  }
  result.candidates = best_of(std::move(all));
  return result;
}

/// The candidates with the highest scores; of neighbouring keyframes only the best.
std::vector<PlaceCandidate> PlaceRecognition::best_of(std::vector<PlaceCandidate> all) const {
  std::vector<PlaceCandidate> best;
  std::stable_sort(all.begin(), all.end(), [](auto& a, auto& b) { return a.score > b.score; });
  for (const auto& candidate : all) {
    if (best.size() >= static_cast<std::size_t>(kCandidates) || candidate.score < kMinScore) break;
    const bool shadowed = std::any_of(best.begin(), best.end(), [&](const auto& c) {
      const auto [first, last] = std::minmax(c.keyframe, candidate.keyframe);
      return last - first <= kNeighbours;
    });
    if (!shadowed) best.push_back(candidate);
  }
  return best;
}

std::size_t PlaceRecognition::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& tree : trees_) bytes += tree.memory_bytes();
  return bytes;
}

}  // namespace stereo_slam
