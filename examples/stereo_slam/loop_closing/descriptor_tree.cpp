// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/descriptor_tree.hpp"

#include <algorithm>
#include <cstring>

namespace stereo_slam {
namespace {

constexpr std::size_t kHalfBytes = sizeof(HalfDescriptor);
constexpr int kHalfBits = 8 * kHalfBytes;
constexpr std::size_t kFullLeaf = 4;   // size limit of a leaf that cannot be split, times leaf_size
constexpr double kWorstBalance = 0.2;  // least share of the smaller part for a split

[[nodiscard]] std::size_t bit_of(const std::uint8_t* bytes, int bit) {
  return (bytes[bit / 8] >> (bit % 8)) & 1U;
}

/// How many of the entries have each bit set.
[[nodiscard]] std::array<int, kHalfBits> count_ones(std::span<const TreeEntry> entries) {
  // One count for each bit of each byte, in an order that lets the compiler add many bytes at a time.
  std::array<std::array<std::uint32_t, kHalfBytes>, 8> counts{};
  for (const TreeEntry& entry : entries) {
    for (std::size_t bit = 0; bit < 8; ++bit) {
      for (std::size_t byte = 0; byte < kHalfBytes; ++byte) {
        counts[bit][byte] += (entry.half[byte] >> bit) & 1U;
      }
    }
  }
  std::array<int, kHalfBits> ones{};
  for (std::size_t bit = 0; bit < ones.size(); ++bit) ones[bit] = static_cast<int>(counts[bit % 8][bit / 8]);
  return ones;
}

}  // namespace

HalfDescriptor DescriptorTree::half_of(const Descriptor& descriptor) const {
  HalfDescriptor half{};
  std::memcpy(half.data(), descriptor.data() + static_cast<std::size_t>(half_) * kHalfBytes, kHalfBytes);
  return half;
}

/// The child of an inner node on the way to the descriptor's leaf.
std::uint32_t DescriptorTree::child(std::uint32_t node, const Descriptor& descriptor) const {
  const std::uint8_t* half = descriptor.data() + static_cast<std::size_t>(half_) * kHalfBytes;
  return nodes_[node].index + static_cast<std::uint32_t>(bit_of(half, nodes_[node].bit));
}

/// The nodes of the points' leaves.
std::vector<std::uint32_t> DescriptorTree::descend(std::span<const KeyframePoint> points) const {
  std::vector<std::uint32_t> nodes(points.size(), 0);
  for (bool all_arrived = false; !all_arrived;) {
    all_arrived = true;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (nodes_[nodes[i]].bit < 0) continue;
      nodes[i] = child(nodes[i], points[i].descriptor);
      __builtin_prefetch(&nodes_[nodes[i]]);
      all_arrived = false;
    }
  }
  for (const std::uint32_t node : nodes) __builtin_prefetch(&leaves_[nodes_[node].index]);
  return nodes;
}

std::vector<std::span<const TreeEntry>> DescriptorTree::leaves_of(
    std::span<const KeyframePoint> points) const {
  std::vector<std::span<const TreeEntry>> leaves;
  leaves.reserve(points.size());
  for (const std::uint32_t node : descend(points)) leaves.emplace_back(leaves_[nodes_[node].index]);
  return leaves;
}

void DescriptorTree::insert(std::span<const KeyframePoint> points, std::uint32_t keyframe) {
  const auto nodes = descend(points);
  for (std::size_t i = 0; i < points.size(); ++i) insert(points[i].descriptor, keyframe, nodes[i]);
}

/// Inserts a descriptor below a node on the way to its leaf.
void DescriptorTree::insert(const Descriptor& descriptor, std::uint32_t keyframe, std::uint32_t node) {
  while (nodes_[node].bit >= 0) node = child(node, descriptor);
  Leaf& leaf = leaves_[nodes_[node].index];
  if (leaf.size() >= kFullLeaf * leaf_size_) return;
  // In small steps, not by doubling: leaves are most of the memory of a map.
  if (leaf.size() == leaf.capacity()) leaf.reserve(leaf.size() + std::max<std::size_t>(leaf_size_ / 8, 1));
  leaf.push_back({half_of(descriptor), keyframe});
  if (leaf.size() % leaf_size_ != 0) return;
  const int bit = best_split(leaf);
  if (bit >= 0) split(node, bit);
}

int DescriptorTree::best_split(const Leaf& leaf) const {
  const auto ones = count_ones(leaf);
  const int count = static_cast<int>(leaf.size());
  int best = -1;
  int best_smaller = static_cast<int>(kWorstBalance * count);
  for (int bit = first_bit_; bit < kHalfBits; bit += bit_step_) {
    const int smaller =
        std::min(ones[static_cast<std::size_t>(bit)], count - ones[static_cast<std::size_t>(bit)]);
    if (smaller > best_smaller) {
      best = bit;
      best_smaller = smaller;
    }
  }
  return best;
}

void DescriptorTree::split(std::uint32_t node, int bit) {
  // The leaf keeps the entries for 0; those for 1 go to a new one.
  const std::uint32_t leaf = nodes_[node].index;
  const auto new_leaf = static_cast<std::uint32_t>(leaves_.size());
  leaves_.emplace_back();
  Leaf& zeros = leaves_[leaf];
  Leaf& ones = leaves_[new_leaf];
  const auto first_one = std::stable_partition(zeros.begin(), zeros.end(), [bit](const TreeEntry& entry) {
    return bit_of(entry.half.data(), bit) == 0;
  });
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

}  // namespace stereo_slam
