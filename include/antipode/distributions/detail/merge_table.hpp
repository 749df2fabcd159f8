// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace antipode::detail {

/// The pairs of a shrinking set of components, ordered by the cost of merging them. A pair starts with a
/// lower bound of its cost, which is cheap. Its cost is computed only when no other pair can be cheaper.
template <class Scalar>
class MergeTable {
 public:
  struct Pair {
    Scalar cost;
    std::size_t i, j;  ///< i < j
  };

  /// All pairs, with the lower bound(i, j); infinite for those that never merge.
  template <class Bound>
  MergeTable(std::size_t count, const Bound& bound)
      : count_(count),
        size_(count),
        alive_(count, true),
        costs_(count * count, kInfinity),
        exact_(count * count, 0),
        partner_(count),
        row_costs_(count) {
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = i + 1; j < count; ++j) costs_[at(i, j)] = bound(i, j);
      rescan(i);
    }
  }

  /// The number of components left.
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool alive(std::size_t i) const { return alive_[i]; }

  /// The pair of least cost(i, j), of equals the first; none if no pair is left that may merge.
  template <class Cost>
  [[nodiscard]] std::optional<Pair> cheapest(const Cost& cost) {
    for (;;) {
      const auto row = std::min_element(row_costs_.begin(), row_costs_.end());
      if (row == row_costs_.end() || !(*row < kInfinity)) return std::nullopt;
      const auto i = static_cast<std::size_t>(row - row_costs_.begin());
      const std::size_t j = partner_[i];
      if (exact_[at(i, j)]) return Pair{*row, i, j};
      costs_[at(i, j)] = cost(i, j);
      exact_[at(i, j)] = 1;
      rescan(i);
    }
  }

  /// Merges j into i; the costs of all pairs of i change.
  template <class Bound>
  void merge(std::size_t i, std::size_t j, const Bound& bound) {
    alive_[j] = false;
    --size_;
    for (std::size_t k = 0; k < count_; ++k) {
      costs_[at(std::min(j, k), std::max(j, k))] = kInfinity;
      if (k == i || !alive_[k]) continue;
      const std::size_t pair = at(std::min(i, k), std::max(i, k));
      costs_[pair] = bound(std::min(i, k), std::max(i, k));
      exact_[pair] = 0;
      if (k > i) continue;  // belongs to row i, see below
      if (partner_[k] == i || partner_[k] == j) {
        rescan(k);
      } else if (costs_[pair] < row_costs_[k]) {
        partner_[k] = i;
        row_costs_[k] = costs_[pair];
      }
    }
    for (std::size_t k = i; k <= j; ++k) {
      if (k == i || k == j || partner_[k] == j) rescan(k);
    }
  }

 private:
  static constexpr Scalar kInfinity = std::numeric_limits<Scalar>::infinity();

  [[nodiscard]] std::size_t at(std::size_t i, std::size_t j) const { return i * count_ + j; }

  /// Finds the cheapest partner of i after it.
  void rescan(std::size_t i) {
    partner_[i] = i;
    row_costs_[i] = kInfinity;
    for (std::size_t j = i + 1; j < count_; ++j) {
      if (costs_[at(i, j)] < row_costs_[i]) {
        partner_[i] = j;
        row_costs_[i] = costs_[at(i, j)];
      }
    }
  }

  std::size_t count_, size_;
  std::vector<bool> alive_;
  std::vector<Scalar> costs_;         // count x count, above the diagonal
  std::vector<char> exact_;           // whether it is the cost, not its bound
  std::vector<std::size_t> partner_;  // of the cheapest pair in each row
  std::vector<Scalar> row_costs_;     // of the same pair
};

}  // namespace antipode::detail
