// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/keyframes/keyframe_database.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// A binary tree over descriptors. Inner nodes test one bit; leaves hold the ids of their descriptors. A full
/// leaf is split by the bit that halves it best.
class DescriptorTree {
 public:
  /// The tree tests bits first_bit, first_bit + bit_step, ... only: trees with different bits miss different
  /// matches.
  DescriptorTree(int first_bit, int bit_step, std::size_t leaf_size)
      : first_bit_(first_bit), bit_step_(bit_step), leaf_size_(leaf_size), nodes_(1) {}

  /// Inserts descriptors[id]. A leaf that no bit can split stops growing, and further descriptors that belong
  /// to it are left out: descriptors that occur everywhere do not identify a place.
  void insert(std::uint32_t id, std::span<const Descriptor> descriptors);

  /// Ids of the descriptors in the leaf of `descriptor`.
  [[nodiscard]] std::span<const std::uint32_t> leaf_of(const Descriptor& descriptor) const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Node {
    int bit = -1;                     // -1: a leaf
    std::uint32_t child[2] = {0, 0};  // for bit 0 and bit 1
    std::vector<std::uint32_t> entries{};
  };

  [[nodiscard]] std::size_t descend(const Descriptor& descriptor) const;
  [[nodiscard]] int best_split(const Node& leaf, std::span<const Descriptor> descriptors) const;
  void split(std::size_t leaf, int bit, std::span<const Descriptor> descriptors);

  int first_bit_;
  int bit_step_;
  std::size_t leaf_size_;
  std::vector<Node> nodes_;
};

/// Keyframe that may show the place of the query.
struct PlaceCandidate {
  std::size_t keyframe = 0;
  double score = 0.0;  ///< 0..1: share of the query's points that voted for it, rare ones counting more
  int votes = 0;
};

struct PlaceQuery {
  std::vector<PlaceCandidate> candidates;  ///< best first
  std::size_t comparisons = 0;             ///< of two descriptors, a measure of the work
};

/// Finds earlier keyframes that look like the current one, by a forest of binary trees over their
/// descriptors. No vocabulary has to be trained or loaded, and a query visits one leaf per point and tree,
/// whatever the number of keyframes.
///
/// Every point votes for the keyframes that have a descriptor within the Hamming bound in one of its leaves;
/// its vote counts log((N + 1) / n) / log(N + 1) if it found n of N keyframes. Deterministic: order of
/// insertion and bits decide, ties go to the lower id. References: D. Schlegel, G. Grisetti, "HBST: A Hamming
/// Distance Embedding Binary Search Tree for Feature-Based Visual Place Recognition", RA-L 2018, for the
/// tree; the forest, the split and the vote are our own.
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
  PlaceRecognitionSettings settings_;
  std::vector<DescriptorTree> trees_;
  std::vector<Descriptor> descriptors_;
  std::vector<std::uint32_t> keyframe_of_;  // of each descriptor
};

}  // namespace stereo_slam
