// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/place_recognition.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "stereo_slam/core/descriptor.hpp"

namespace stereo_slam {
namespace {

constexpr int kBits = 256;
constexpr std::size_t kFullLeaf = 4;   // size limit of a leaf that cannot be split, times leaf_size
constexpr double kWorstBalance = 0.2;  // least share of the smaller part for a split
constexpr std::size_t kFetchedAhead = 8;
constexpr std::size_t kNeighbours = 3;  // keyframes before and after that show the same place

[[nodiscard]] std::size_t bit_of(const Descriptor& descriptor, int bit) {
  return (descriptor[static_cast<std::size_t>(bit / 8)] >> (bit % 8)) & 1U;
}

[[nodiscard]] std::size_t distance_of_ids(std::size_t a, std::size_t b) { return a > b ? a - b : b - a; }

}  // namespace

std::size_t DescriptorTree::descend(const Descriptor& descriptor) const {
  std::size_t node = 0;
  while (nodes_[node].bit >= 0) node = nodes_[node].child[bit_of(descriptor, nodes_[node].bit)];
  return node;
}

std::span<const std::uint32_t> DescriptorTree::leaf_of(const Descriptor& descriptor) const {
  return nodes_[descend(descriptor)].entries;
}

void DescriptorTree::insert(std::uint32_t id, std::span<const Descriptor> descriptors) {
  const std::size_t leaf = descend(descriptors[id]);
  auto& entries = nodes_[leaf].entries;
  if (entries.size() >= kFullLeaf * leaf_size_) return;
  entries.push_back(id);
  if (entries.size() % leaf_size_ != 0) return;
  const int bit = best_split(nodes_[leaf], descriptors);
  if (bit >= 0) split(leaf, bit, descriptors);
}

int DescriptorTree::best_split(const Node& leaf, std::span<const Descriptor> descriptors) const {
  std::array<int, kBits> ones{};
  for (const std::uint32_t id : leaf.entries) {
    for (int bit = first_bit_; bit < kBits; bit += bit_step_) {
      ones[static_cast<std::size_t>(bit)] += static_cast<int>(bit_of(descriptors[id], bit));
    }
  }
  const int count = static_cast<int>(leaf.entries.size());
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

void DescriptorTree::split(std::size_t leaf, int bit, std::span<const Descriptor> descriptors) {
  const auto first_child = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  for (const std::uint32_t id : nodes_[leaf].entries) {
    nodes_[first_child + bit_of(descriptors[id], bit)].entries.push_back(id);
  }
  nodes_[leaf] = {.bit = bit, .child = {first_child, first_child + 1}};
}

std::size_t DescriptorTree::memory_bytes() const {
  std::size_t bytes = nodes_.capacity() * sizeof(Node);
  for (const auto& node : nodes_) bytes += node.entries.capacity() * sizeof(std::uint32_t);
  return bytes;
}

PlaceRecognition::PlaceRecognition(const PlaceRecognitionSettings& settings) : settings_(settings) {
  for (int tree = 0; tree < settings.trees; ++tree) {
    trees_.emplace_back(tree, settings.trees, static_cast<std::size_t>(settings.leaf_size));
  }
}

void PlaceRecognition::add(std::size_t keyframe, std::span<const KeyframePoint> points) {
  for (const auto& point : points) {
    const auto id = static_cast<std::uint32_t>(descriptors_.size());
    descriptors_.push_back(point.descriptor);
    keyframe_of_.push_back(static_cast<std::uint32_t>(keyframe));
    for (auto& tree : trees_) tree.insert(id, descriptors_);
  }
}

PlaceQuery PlaceRecognition::query(std::span<const KeyframePoint> points, std::size_t end) const {
  PlaceQuery result;
  if (end == 0 || points.empty()) return result;
  std::vector<PlaceCandidate> all(end);
  for (std::size_t id = 0; id < end; ++id) all[id].keyframe = id;
  const double log_all = std::log(static_cast<double>(end) + 1.0);
  // The ids of descriptors grow with those of keyframes: this is the first one that is too new.
  const auto newer = std::lower_bound(keyframe_of_.begin(), keyframe_of_.end(), end);
  const auto end_id = static_cast<std::uint32_t>(newer - keyframe_of_.begin());
  std::vector<std::uint32_t> found;
  for (const auto& point : points) {
    found.clear();
    for (const auto& tree : trees_) {
      const auto leaf = tree.leaf_of(point.descriptor);
      // The descriptors of a leaf lie anywhere in memory; waiting for each would take most of the time.
      const auto fetch = [&](std::size_t i) {
        if (i < leaf.size()) __builtin_prefetch(descriptors_[leaf[i]].data());
      };
      for (std::size_t i = 0; i < kFetchedAhead; ++i) fetch(i);
      for (std::size_t i = 0; i < leaf.size(); ++i) {
        fetch(i + kFetchedAhead);
        const std::uint32_t id = leaf[i];
        if (id >= end_id) break;  // the ids of a leaf grow
        ++result.comparisons;
        if (hamming_distance(descriptors_[id], point.descriptor) <= settings_.max_descriptor_distance) {
          found.push_back(keyframe_of_[id]);
        }
      }
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
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
  std::size_t bytes =
      descriptors_.capacity() * sizeof(Descriptor) + keyframe_of_.capacity() * sizeof(std::uint32_t);
  for (const auto& tree : trees_) bytes += tree.memory_bytes();
  return bytes;
}

}  // namespace stereo_slam
