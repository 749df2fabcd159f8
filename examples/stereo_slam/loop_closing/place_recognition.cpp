// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/place_recognition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "stereo_slam/core/differing_bits.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kBytes = sizeof(HalfDescriptor);
constexpr int kBits = 8 * kBytes;
constexpr std::size_t kFullLeaf = 4;    // size limit of a leaf that cannot be split, times leaf_size
constexpr double kWorstBalance = 0.2;   // least share of the smaller part for a split
constexpr std::size_t kNeighbours = 3;  // keyframes before and after that show the same place

[[nodiscard]] std::size_t bit_of(const HalfDescriptor& half, int bit) {
  return (half[static_cast<std::size_t>(bit / 8)] >> (bit % 8)) & 1U;
}

/// How many of the entries have each bit set.
[[nodiscard]] std::array<int, kBits> count_ones(std::span<const TreeEntry> entries) {
  // One count for each bit of each byte, in an order that lets the compiler add many bytes at a time.
  std::array<std::array<std::uint32_t, kBytes>, 8> counts{};
  for (const TreeEntry& entry : entries) {
    for (std::size_t bit = 0; bit < 8; ++bit) {
      for (std::size_t byte = 0; byte < kBytes; ++byte) {
        counts[bit][byte] += (entry.half[byte] >> bit) & 1U;
      }
    }
  }
  std::array<int, kBits> ones{};
  for (std::size_t bit = 0; bit < ones.size(); ++bit) ones[bit] = static_cast<int>(counts[bit % 8][bit / 8]);
  return ones;
}

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
  const auto newer =
      std::lower_bound(leaf.begin(), leaf.end(), end,
                       [](const TreeEntry& entry, std::size_t e) { return entry.keyframe < e; });
  return leaf.first(static_cast<std::size_t>(newer - leaf.begin()));
}

[[nodiscard]] std::size_t distance_of_ids(std::size_t a, std::size_t b) { return a > b ? a - b : b - a; }

}  // namespace

HalfDescriptor DescriptorTree::half_of(const Descriptor& descriptor) const {
  HalfDescriptor half{};
  std::memcpy(half.data(), descriptor.data() + static_cast<std::size_t>(half_) * kBytes, kBytes);
  return half;
}

std::size_t DescriptorTree::descend(const HalfDescriptor& half) const {
  std::size_t node = 0;
  while (nodes_[node].bit >= 0) node = nodes_[node].index + bit_of(half, nodes_[node].bit);
  return node;
}

std::span<const TreeEntry> DescriptorTree::leaf_of(const HalfDescriptor& half) const {
  return leaves_[nodes_[descend(half)].index];
}

void DescriptorTree::insert(const Descriptor& descriptor, std::uint32_t keyframe) {
  const HalfDescriptor half = half_of(descriptor);
  const std::size_t node = descend(half);
  Leaf& leaf = leaves_[nodes_[node].index];
  if (leaf.size() >= kFullLeaf * leaf_size_) return;
  // In small steps, not by doubling: leaves are most of the memory of a map.
  if (leaf.size() == leaf.capacity()) leaf.reserve(leaf.size() + std::max<std::size_t>(leaf_size_ / 8, 1));
  leaf.push_back({half, keyframe});
  if (leaf.size() % leaf_size_ != 0) return;
  const int bit = best_split(leaf);
  if (bit >= 0) split(node, bit);
}

int DescriptorTree::best_split(const Leaf& leaf) const {
  const auto ones = count_ones(leaf);
  const int count = static_cast<int>(leaf.size());
  int best = -1;
  int best_smaller = static_cast<int>(kWorstBalance * count);
  for (int bit = first_bit_; bit < kBits; bit += bit_step_) {
    const int smaller =
        std::min(ones[static_cast<std::size_t>(bit)], count - ones[static_cast<std::size_t>(bit)]);
    if (smaller > best_smaller) {
      best = bit;
      best_smaller = smaller;
    }
  }
  return best;
}

void DescriptorTree::split(std::size_t node, int bit) {
  // The leaf keeps the entries for 0; those for 1 go to a new one.
  const std::uint32_t leaf = nodes_[node].index;
  const auto new_leaf = static_cast<std::uint32_t>(leaves_.size());
  leaves_.emplace_back();
  Leaf& zeros = leaves_[leaf];
  Leaf& ones = leaves_[new_leaf];
  const auto first_one = std::stable_partition(
      zeros.begin(), zeros.end(), [bit](const TreeEntry& entry) { return bit_of(entry.half, bit) == 0; });
  ones.assign(first_one, zeros.end());
  zeros.erase(first_one, zeros.end());
  zeros.shrink_to_fit();
  nodes_[node] = {.bit = bit, .index = static_cast<std::uint32_t>(nodes_.size())};
  nodes_.push_back({.index = leaf});
  nodes_.push_back({.index = new_leaf});
}

std::size_t DescriptorTree::memory_bytes() const {
  std::size_t bytes = nodes_.capacity() * sizeof(Node) + leaves_.capacity() * sizeof(Leaf);
  for (const auto& leaf : leaves_) bytes += leaf.capacity() * sizeof(TreeEntry);
  return bytes;
}

PlaceRecognition::PlaceRecognition(const PlaceRecognitionSettings& settings) : settings_(settings) {
  for (int tree = 0; tree < settings.trees; ++tree) {
    const int half = tree % 2;
    const int trees_of_this_half = (settings.trees + 1 - half) / 2;
    trees_.emplace_back(half, tree / 2, trees_of_this_half, static_cast<std::size_t>(settings.leaf_size));
  }
}

void PlaceRecognition::add(std::size_t keyframe, std::span<const KeyframePoint> points) {
  for (auto& tree : trees_) {
    for (const auto& point : points) tree.insert(point.descriptor, static_cast<std::uint32_t>(keyframe));
  }
}

/// Sets `found` to the keyframes below `end` that have a point similar to this one, in order. Returns the
/// number of comparisons.
std::size_t PlaceRecognition::find_similar(const Descriptor& descriptor, std::size_t end,
                                           std::vector<std::uint32_t>& found) const {
  for (const auto& tree : trees_) prefetch(tree.leaf_of(tree.half_of(descriptor)));
  found.clear();
  std::size_t comparisons = 0;
  for (const auto& tree : trees_) {
    const HalfDescriptor half = tree.half_of(descriptor);
    const auto entries = older_than(end, tree.leaf_of(half));
    comparisons += entries.size();
    append_similar(half, entries, settings_.max_descriptor_distance / 2, found);
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return comparisons;
}

PlaceQuery PlaceRecognition::query(std::span<const KeyframePoint> points, std::size_t end) const {
  PlaceQuery result;
  if (end == 0 || points.empty()) return result;
  std::vector<PlaceCandidate> all(end);
  for (std::size_t id = 0; id < end; ++id) all[id].keyframe = id;
  const double log_all = std::log(static_cast<double>(end) + 1.0);
  std::vector<std::uint32_t> found;
  for (const auto& point : points) {
    result.comparisons += find_similar(point.descriptor, end, found);
    const double weight =
        1.0 - std::log(static_cast<double>(std::max<std::size_t>(found.size(), 1))) / log_all;
    for (const std::uint32_t id : found) {
      all[id].score += weight / static_cast<double>(points.size());
      ++all[id].votes;
    }
  }
  std::stable_sort(all.begin(), all.end(), [](auto& a, auto& b) { return a.score > b.score; });
  for (const auto& candidate : all) {
    if (result.candidates.size() >= static_cast<std::size_t>(settings_.candidates) ||
        candidate.score < settings_.min_score || candidate.votes == 0) {
      break;
    }
    const bool shadowed = std::any_of(result.candidates.begin(), result.candidates.end(), [&](const auto& c) {
      return distance_of_ids(c.keyframe, candidate.keyframe) <= kNeighbours;
    });
    if (!shadowed) result.candidates.push_back(candidate);
  }
  return result;
}

std::size_t PlaceRecognition::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& tree : trees_) bytes += tree.memory_bytes();
  return bytes;
}

}  // namespace stereo_slam
