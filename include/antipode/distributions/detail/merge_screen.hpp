// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// Finds the pair of a large set of weighted components that costs least to merge, in O(n^2), eight pairs at
/// a time and without a table of all pairs.
///
/// The costs are Runnalls', in single precision and to first order in the angle between the tangent points:
/// both covariances are taken as if in one chart. That is accurate enough to choose a pair; the caller
/// computes what the merge costs. `Real` is the single precision. It is a template parameter so that the
/// expressions below are compiled only in files that use them.
template <class Density, class Real = float>
class MergeScreen {
 public:
  using Scalar = typename Density::Scalar;
  struct Pair {
    std::size_t i, j;  ///< i < j
  };

  /// `components` have a weight and a centred, regular density. Pairs with |q_i.q_j| < min_cosine, for the
  /// tangent points q_i and q_j, are never merged.
  template <class Element>
  MergeScreen(const std::vector<Element>& components, Scalar min_cosine)
      : min_cosine_(static_cast<Real>(min_cosine)), size_(components.size()) {
    Matrix6<Scalar> mean = Matrix6<Scalar>::Zero();
    for (const Element& c : components) mean += c.weight * c.density.covariance();
    const auto L = cholesky_factor<Scalar, 6>(mean);
    inverse_root_ =
        solve_lower<Scalar, 6, 6>(L ? *L : Matrix6<Scalar>::Identity(), Matrix6<Scalar>::Identity());
    for (int row = 0; row < 6; ++row) {
      for (int col = 0; col <= row; ++col) {
        whitening_[static_cast<std::size_t>(at(row, col))] = static_cast<Real>(inverse_root_(row, col));
      }
    }
    log_peak_ = L ? gaussian_log_peak(*L) : Scalar(0);
    resize(components.size());
    for (std::size_t i = 0; i < components.size(); ++i) {
      ids_[i] = i;
      set(i, components[i].weight, components[i].density);
    }
    for (std::size_t i = 0; i < components.size(); ++i) search(i);
  }

  /// The number of components left.
  [[nodiscard]] std::size_t size() const { return size_; }

  /// The pair that costs least; none if no pair is left that may merge.
  [[nodiscard]] std::optional<Pair> cheapest() {
    for (;;) {
      const auto row = std::min_element(rows_.begin(), rows_.end(),
                                        [](const Row& x, const Row& y) { return x.least() < y.least(); });
      if (row == rows_.end() || !(row->least() < kInfinity)) return std::nullopt;
      const auto i = static_cast<std::size_t>(row - rows_.begin());
      if (row->count > 0) {
        best_ = {i, row->partners[0]};
        return Pair{ids_[best_.i], ids_[best_.j]};
      }
      search(i);
    }
  }

  /// Merges the pair (i, j) found last: component i becomes `merged`, component j is removed.
  void merge_cheapest(Scalar merged_weight, const Density& merged) {
    const auto [i, j] = best_;
    --size_;
    remove(j);
    set(i, merged_weight, merged);
    for (std::size_t k = 0; k < j; ++k) rows_[k].remove(i, j);
    for (std::size_t b = 0; b * kLanes < i; ++b) {  // the pairs (k, i) of rows above
      const Lanes costs = costs_of(i, blocks_[b]);
      for (std::size_t k = b * kLanes; k < std::min(i, (b + 1) * kLanes); ++k) {
        if (costs[lane(k)] < rows_[k].complete_below && alive(k) && near(k, i))
          rows_[k].add(i, costs[lane(k)]);
      }
    }
    search(i);
    if (4 * size_ <= 3 * ids_.size()) compact();
  }

 private:
  static constexpr std::size_t kLanes = 8;
  static constexpr Real kSmallestPivot = Real(1e-12F);
  static constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
  using Lanes = Eigen::Array<Real, static_cast<int>(kLanes), 1>;
  using LowerTriangle = Eigen::Array<Real, static_cast<int>(kLanes), 21>;  // row by row
  /// Eight components, a row each: q, t, the lower triangle of S whitened by the mean covariance of all,
  /// log|S|/2 and the weight. Removed components have the weight 0 and -infinity as log|S|, so that their
  /// costs are NaN.
  using Block = Eigen::Array<Real, static_cast<int>(kLanes), 30>;
  /// The cheapest partners of a component among those after it, by ascending cost: all that cost less than
  /// `complete_below`, at most kKept.
  struct Row {
    static constexpr std::size_t kKept = 8;
    std::array<std::size_t, kKept> partners;
    std::array<Real, kKept> costs;
    std::size_t count = 0;
    Real complete_below = kInfinity;

    /// A lower bound of the row's costs, exact if there is a partner.
    [[nodiscard]] Real least() const { return count > 0 ? costs[0] : complete_below; }
    void add(std::size_t partner, Real cost) {
      if (count == kKept) {
        complete_below = costs[kKept - 1];
        if (!(cost < complete_below)) return;
        --count;
      }
      std::size_t place = count++;
      for (; place > 0 && cost < costs[place - 1]; --place) {
        costs[place] = costs[place - 1];
        partners[place] = partners[place - 1];
      }
      costs[place] = cost;
      partners[place] = partner;
    }
    void remove(std::size_t i, std::size_t j) {
      std::size_t left = 0;
      for (std::size_t k = 0; k < count; ++k) {
        if (partners[k] == i || partners[k] == j) continue;
        costs[left] = costs[k];
        partners[left++] = partners[k];
      }
      count = left;
    }
  };
  enum Column { kRotation = 0, kTranslation = 4, kCovariance = 7, kHalfLogDeterminant = 28, kWeight = 29 };

  [[nodiscard]] static int lane(std::size_t i) { return static_cast<int>(i % kLanes); }
  [[nodiscard]] auto component(std::size_t i) { return blocks_[i / kLanes].row(lane(i)); }
  [[nodiscard]] auto component(std::size_t i) const { return blocks_[i / kLanes].row(lane(i)); }
  [[nodiscard]] bool alive(std::size_t i) const { return component(i)[kWeight] > 0; }
  [[nodiscard]] bool near(std::size_t i, std::size_t j) const {
    Real cosine = 0;
    for (int k = 0; k < 4; ++k) cosine += component(i)[k] * component(j)[k];
    return std::abs(cosine) >= min_cosine_;
  }

  void resize(std::size_t count) {
    blocks_.resize((count + kLanes - 1) / kLanes);
    ids_.resize(count);
    rows_.assign(count, Row());
    for (std::size_t i = 0; i < blocks_.size() * kLanes; ++i) remove(i);
  }

  void remove(std::size_t i) {
    component(i).setOnes();
    component(i)[kHalfLogDeterminant] = -kInfinity;
    component(i)[kWeight] = 0;
    if (i < rows_.size()) rows_[i] = Row();
  }

  /// Closes the gaps that merging has left.
  void compact() {
    const MergeScreen old = *this;
    std::vector<std::size_t> places(old.ids_.size());
    resize(size_);
    std::size_t count = 0;
    for (std::size_t i = 0; i < old.ids_.size(); ++i) {
      if (!old.alive(i)) continue;
      places[i] = count;
      component(count) = old.component(i);
      ids_[count] = old.ids_[i];
      rows_[count++] = old.rows_[i];
    }
    for (Row& row : rows_) {
      for (std::size_t k = 0; k < row.count; ++k) row.partners[k] = places[row.partners[k]];
    }
  }

  void set(std::size_t i, Scalar weight, const Density& x) {
    const Matrix6<Scalar> S = congruence<Scalar, 6, 6>(inverse_root_, x.covariance());
    auto entries = component(i);
    for (int k = 0; k < 4; ++k) entries[kRotation + k] = static_cast<Real>(x.tangent_point()[k]);
    for (int k = 0; k < 3; ++k) entries[kTranslation + k] = static_cast<Real>(x.mean()[3 + k]);
    for (int row = 0; row < 6; ++row) {
      for (int col = 0; col <= row; ++col)
        entries[kCovariance + at(row, col)] = static_cast<Real>(S(row, col));
    }
    entries[kHalfLogDeterminant] = static_cast<Real>(log_peak_ - x.gaussian_log_peak());
    entries[kWeight] = static_cast<Real>(weight);
  }

  /// The place of an entry in a lower triangle.
  [[nodiscard]] static constexpr int at(int row, int col) { return row * (row + 1) / 2 + col; }

  [[nodiscard]] Real whitening(int row, int col) const {
    return whitening_[static_cast<std::size_t>(at(row, col))];
  }

  /// Finds the cheapest partners of i after it.
  void search(std::size_t i) {
    rows_[i] = Row();
    for (std::size_t b = i / kLanes; b < blocks_.size(); ++b) {
      const Lanes costs = costs_of(i, blocks_[b]);
      for (std::size_t j = std::max(i + 1, b * kLanes); j < std::min(ids_.size(), (b + 1) * kLanes); ++j) {
        if (costs[lane(j)] < rows_[i].complete_below && near(i, j)) rows_[i].add(j, costs[lane(j)]);
      }
    }
  }

  /// The costs of merging i with each component of a block.
  [[nodiscard]] Lanes costs_of(std::size_t i, const Block& others) const {
    const Block& own_block = blocks_[i / kLanes];
    const int l = lane(i);
    const Real w = own_block(l, kWeight);
    const Lanes sum = others.col(kWeight) + w;
    const Lanes b = others.col(kWeight) / sum;
    const Lanes ab = b * (Real(1) - b);
    const Differences d = whitened_differences(own_block, l, others);
    // M = a S_i + b S_j + a b d d^T, eliminated column by column: rest is what is left of M, factor
    // rest/pivot.
    LowerTriangle rest, factor;
    std::array<Lanes, 2> pivots = {Lanes::Ones(), Lanes::Ones()};
    for (int col = 0; col < 6; ++col) {
      const Lanes scaled = ab * d.col(col);
      Lanes inverse = Lanes::Ones();
      for (int row = col; row < 6; ++row) {
        const int entry = at(row, col);
        const Real s = own_block(l, kCovariance + entry);
        Lanes sum_of_products = s + b * (others.col(kCovariance + entry) - s) + scaled * d.col(row);
        for (int k = 0; k < col; ++k) sum_of_products -= rest.col(at(row, k)) * factor.col(at(col, k));
        if (row == col) {
          const Lanes pivot = sum_of_products.max(kSmallestPivot);
          pivots[static_cast<std::size_t>(col / 3)] *= pivot;
          inverse = pivot.inverse();
        } else {
          rest.col(entry) = sum_of_products;
          factor.col(entry) = sum_of_products * inverse;
        }
      }
    }
    return Real(0.5) * sum * (pivots[0].log() + pivots[1].log()) - w * own_block(l, kHalfLogDeterminant) -
           others.col(kWeight) * others.col(kHalfLogDeterminant);
  }

  using Differences = Eigen::Array<Real, static_cast<int>(kLanes), 6>;
  /// The coordinates (u, t) of each component of a block in the chart of component `l` of `own`, relative to
  /// that component, whitened.
  [[nodiscard]] Differences whitened_differences(const Block& own, int l, const Block& others) const {
    const Real qw = own(l, 0), qx = own(l, 1), qy = own(l, 2), qz = own(l, 3);
    const auto rw = others.col(0), rx = others.col(1), ry = others.col(2), rz = others.col(3);
    const Lanes inverse = (qw * rw + qx * rx + qy * ry + qz * rz).inverse();  // q_own* q
    Differences d;
    d.col(0) = (qw * rx - qx * rw - qy * rz + qz * ry) * inverse;
    d.col(1) = (qw * ry + qx * rz - qy * rw - qz * rx) * inverse;
    d.col(2) = (qw * rz - qx * ry + qy * rx - qz * rw) * inverse;
    for (int k = 0; k < 3; ++k) {
      d.col(3 + k) = others.col(kTranslation + k) - own(l, kTranslation + k);
    }
    for (int row = 5; row >= 0; --row) {
      Lanes whitened = whitening(row, 0) * d.col(0);
      for (int col = 1; col <= row; ++col) whitened += whitening(row, col) * d.col(col);
      d.col(row) = whitened;
    }
    return d;
  }

  Real min_cosine_;
  std::size_t size_;
  Pair best_ = {};
  std::vector<Block> blocks_;
  std::vector<std::size_t> ids_;  // index of each in the constructor's argument
  std::vector<Row> rows_;
  Matrix6<Scalar> inverse_root_;    // of the mean covariance
  std::array<Real, 21> whitening_;  // its lower triangle
  Scalar log_peak_ = 0;             // of a Gaussian with the mean covariance
};

}  // namespace antipode::detail
