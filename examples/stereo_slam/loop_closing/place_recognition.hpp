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

/// A binary tree over descriptors. Inner nodes look at one bit, leaves hold the numbers of the descriptors
/// that end there; a leaf that overflows is split by the bit that halves it best.
class DescriptorTree {
 public:
  /// The tree looks at bits first, first + step, ... only: trees with different bits miss different matches.
  DescriptorTree(int first_bit, int bit_step, std::size_t leaf_size)
      : first_bit_(first_bit), bit_step_(bit_step), leaf_size_(leaf_size), nodes_(1) {}

  /// Puts descriptors[number] in. Descriptors that no bit tells apart fill their leaf, and are then left out:
  /// what looks alike everywhere marks no place.
  void insert(std::uint32_t number, std::span<const Descriptor> descriptors);

  /// Numbers of the descriptors in the leaf where `descriptor` ends.
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
  std::size_t comparisons = 0;             ///< of two descriptors: the work done
};

/// Finds earlier keyframes that look like the present one, by a forest of binary trees over their
/// descriptors: no vocabulary has to be trained or loaded, and a query looks at a few leaves a point however
/// many keyframes there are.
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

  /// Keyframes with ids below `end` that look like `points`. Of neighbours only the best is returned.
  [[nodiscard]] PlaceQuery query(std::span<const KeyframePoint> points, std::size_t end) const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  PlaceRecognitionSettings settings_;
  std::vector<DescriptorTree> trees_;
  std::vector<Descriptor> descriptors_;
  std::vector<std::uint32_t> keyframe_of_;  // of each descriptor
};

}  // namespace stereo_slam
