// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/keyframes/keyframe_database.hpp"
#include "stereo_slam/settings/settings.hpp"

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

  /// Inserts a descriptor of a keyframe. A leaf that no bit can split stops growing, and further descriptors
  /// that belong to it are left out: descriptors that occur everywhere do not identify a place.
  void insert(const Descriptor& descriptor, std::uint32_t keyframe);

  /// What is in the leaf of `half`, in the order of insertion.
  [[nodiscard]] std::span<const TreeEntry> leaf_of(const HalfDescriptor& half) const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  /// An inner node, or a leaf. Small, so that the nodes of a large map stay in the cache.
  struct Node {
    std::int32_t bit = -1;    // -1: a leaf
    std::uint32_t index = 0;  // of the child for 0, which the child for 1 follows; of a leaf, in leaves_
  };
  using Leaf = std::vector<TreeEntry>;

  [[nodiscard]] std::size_t descend(const HalfDescriptor& half) const;
  [[nodiscard]] int best_split(const Leaf& leaf) const;
  void split(std::size_t node, int bit);

  int half_;
  int first_bit_;
  int bit_step_;
  std::size_t leaf_size_;
  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
};

/// Keyframe that may show the place of the query.
struct PlaceCandidate {
  std::size_t keyframe = 0;
  double score = 0.0;  ///< 0..1: share of the query's points that voted for it, rare ones counting more
  int votes = 0;
};

struct PlaceQuery {
  std::vector<PlaceCandidate> candidates;  ///< best first
  std::size_t comparisons = 0;             ///< of two halves of descriptors, a measure of the work
};

/// Finds earlier keyframes that look like the current one, by a forest of binary trees over their
/// descriptors. No vocabulary has to be trained or loaded, and a query visits one leaf per point and tree,
/// whatever the number of keyframes.
///
/// Every point votes for the keyframes that have a descriptor within the Hamming bound in one of its leaves,
/// by the 128 bits that a tree keeps and half of the bound: reading all 256 bits, from elsewhere in memory,
/// would take most of the time. Its vote counts log((N + 1) / n) / log(N + 1) if it found n of N keyframes.
/// Deterministic: order of insertion and bits decide, ties go to the lower id. References: D. Schlegel, G.
/// Grisetti, "HBST: A Hamming Distance Embedding Binary Search Tree for Feature-Based Visual Place
/// Recognition", RA-L 2018, for the tree; the forest, the split and the vote are our own.
class PlaceRecognition {
 public:
  explicit PlaceRecognition(const PlaceRecognitionSettings& settings);

  /// Adds the points of a keyframe. Keyframes come in order of their ids.
  void add(std::size_t keyframe, std::span<const KeyframePoint> points);

  /// Keyframes with ids below `end` that have points similar to `points`; of neighbouring keyframes only the
  /// best.
  [[nodiscard]] PlaceQuery query(std::span<const KeyframePoint> points, std::size_t end) const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  std::size_t find_similar(const Descriptor& descriptor, std::size_t end,
                           std::vector<std::uint32_t>& found) const;

  PlaceRecognitionSettings settings_;
  std::vector<DescriptorTree> trees_;
};

}  // namespace stereo_slam
