// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stereo_slam/loop_closing/descriptor_tree.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Keyframe that may show the place of the query.
struct PlaceCandidate {
  std::size_t keyframe = 0;
  double score = 0.0;  ///< 0..1: share of the query's points that voted for it, rare ones counting more
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
  [[nodiscard]] std::vector<PlaceCandidate> best_of(std::vector<PlaceCandidate> all) const;

  PlaceRecognitionSettings settings_;
  std::vector<DescriptorTree> trees_;
};

}  // namespace stereo_slam
