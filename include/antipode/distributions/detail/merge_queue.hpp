// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <tuple>
#include <vector>

namespace antipode::detail {

/// The pairs of a shrinking set of things, by what merging them costs. A pair starts with a lower bound of
/// its cost, which is cheap, and is worked out only when no other pair can be cheaper.
template <class Scalar>
class MergeQueue {
 public:
  struct Pair {
    Scalar cost;
    std::size_t i, j;  ///< i < j
  };

  /// All pairs, with the lower bound(i, j); infinite for those that never merge.
  template <class Bound>
  MergeQueue(std::size_t count, const Bound& bound) : versions_(count, 0), alive_(count, true), size_(count) {
    heap_.reserve(count * count);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = i + 1; j < count; ++j) push(i, j, bound(i, j), false);
    }
  }

  /// How many things are left.
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool alive(std::size_t i) const { return alive_[i]; }

  /// The pair of least cost(i, j); none if no pair is left that may merge.
  template <class Cost>
  [[nodiscard]] std::optional<Pair> cheapest(const Cost& cost) {
    while (!heap_.empty()) {
      const Entry entry = heap_.front();
      const bool current = alive_[entry.i] && alive_[entry.j] && versions_[entry.i] == entry.version_i &&
                           versions_[entry.j] == entry.version_j;
      if (current && entry.exact) return Pair{entry.key, entry.i, entry.j};
      std::pop_heap(heap_.begin(), heap_.end(), later);
      heap_.pop_back();
      if (current) push(entry.i, entry.j, cost(entry.i, entry.j), true);
    }
    return std::nullopt;
  }

  /// j goes into i, which is another thing from now on.
  template <class Bound>
  void merge(std::size_t i, std::size_t j, const Bound& bound) {
    alive_[j] = false;
    --size_;
    ++versions_[i];
    for (std::size_t k = 0; k < alive_.size(); ++k) {
      if (k == i || !alive_[k]) continue;
      const auto [first, second] = std::minmax(i, k);
      push(first, second, bound(first, second), false);
    }
  }

 private:
  struct Entry {
    Scalar key;
    std::size_t i, j;
    int version_i, version_j;
    bool exact;
  };
  [[nodiscard]] static bool later(const Entry& a, const Entry& b) {
    return std::tie(a.key, a.i, a.j) > std::tie(b.key, b.i, b.j);
  }

  void push(std::size_t i, std::size_t j, Scalar key, bool exact) {
    if (!(key < std::numeric_limits<Scalar>::infinity())) return;
    heap_.push_back({key, i, j, versions_[i], versions_[j], exact});
    std::push_heap(heap_.begin(), heap_.end(), later);
  }

  std::vector<Entry> heap_;  // the least key in front
  std::vector<int> versions_;
  std::vector<bool> alive_;
  std::size_t size_;
};

}  // namespace antipode::detail
