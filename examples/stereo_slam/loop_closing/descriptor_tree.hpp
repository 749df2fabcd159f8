// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"

namespace stereo_slam {

/// Half of a descriptor, 128 bits: what one tree keeps of it.
using HalfDescriptor = std::array<std::uint8_t, 16>;

/// Half of the descriptor of a keyframe's point.
struct TreeEntry {
  HalfDescriptor half;
  std::uint32_t keyframe;
};

/// A binary tree over halves of descriptors. Inner nodes test one bit; leaves hold the halves themselves,
/// side by side in memory. A full leaf is split by the bit that halves it best.
///
/// Reading a tree is waiting for memory. All points of a keyframe therefore descend together, a level at a
/// time, so that their waits overlap.
class DescriptorTree {
 public:
  /// The tree keeps one half of each descriptor, the first (0) or the second (1), and tests bits first_bit,
  /// first_bit + bit_step, ... of it only: trees with different bits miss different matches.
  DescriptorTree(int half, int first_bit, int bit_step, std::size_t leaf_size)
      : half_(half),
        first_bit_(first_bit),
        bit_step_(bit_step),
        leaf_size_(leaf_size),
        nodes_(1),
        leaves_(1) {}

  /// The half of a descriptor that the tree keeps.
  [[nodiscard]] HalfDescriptor half_of(const Descriptor& descriptor) const;

  /// Inserts the descriptors of a keyframe's points, in order. A leaf that no bit can split stops growing,
  /// and further descriptors that belong to it are left out: descriptors that occur everywhere do not
  /// identify a place.
  void insert(std::span<const KeyframePoint> points, std::uint32_t keyframe);

  /// What is in the leaf of each point's descriptor, in the order of insertion.
  [[nodiscard]] std::vector<std::span<const TreeEntry>> leaves_of(
      std::span<const KeyframePoint> points) const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  /// An inner node, or a leaf. Small, so that the nodes of a large map stay in the cache.
  struct Node {
    std::int32_t bit = -1;    // -1: a leaf
    std::uint32_t index = 0;  // of the child for 0, which the child for 1 follows; of a leaf, in leaves_
  };
  using Leaf = std::vector<TreeEntry>;

  [[nodiscard]] std::vector<std::uint32_t> descend(std::span<const KeyframePoint> points) const;
  [[nodiscard]] std::uint32_t child(std::uint32_t node, const Descriptor& descriptor) const;
  void insert(const Descriptor& descriptor, std::uint32_t keyframe, std::uint32_t node);
  [[nodiscard]] int best_split(const Leaf& leaf) const;
  void split(std::uint32_t node, int bit);

  int half_;
  int first_bit_;
  int bit_step_;
  std::size_t leaf_size_;
  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
};

}  // namespace stereo_slam
