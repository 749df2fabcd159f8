// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/selected_inverse.hpp"

#include <algorithm>
#include <utility>

namespace stereo_slam {

SelectedInverse::SelectedInverse(const SparseFactor& factor)
    : lower_(SparseMatrix(factor.matrixL()).triangularView<Eigen::StrictlyLower>()),
      diagonal_(factor.vectorD().cwiseInverse()),
      permuted_(factor.permutationP().indices()) {
  lower_.makeCompressed();
  std::vector<double> sums(static_cast<std::size_t>(lower_.rows()), 0.0);
  for (int column = static_cast<int>(lower_.cols()) - 1; column >= 0; --column) compute_column(column, sums);
}

/// Z_j = -Z L_j below the diagonal and Z_jj = 1 / D_j - L_j^T Z_j, where the columns of Z after j are known.
/// `sums` has zeros before and after.
void SelectedInverse::compute_column(int column, std::vector<double>& sums) {
  const int begin = lower_.outerIndexPtr()[column], end = lower_.outerIndexPtr()[column + 1];
  const auto row = [&](int entry) { return lower_.innerIndexPtr()[entry]; };
  const auto sum = [&](int i) -> double& { return sums[static_cast<std::size_t>(i)]; };
  Eigen::VectorXd L(end - begin);
  for (int k = begin; k < end; ++k) L[k - begin] = std::exchange(lower_.valuePtr()[k], 0.0);
  for (int k = begin; k < end; ++k) {
    sum(row(k)) += diagonal_[row(k)] * L[k - begin];
    // The rows of this column after row k are all among those of column row(k).
    int i = k + 1;
    for (SparseMatrix::InnerIterator Z(lower_, row(k)); Z && i < end; ++Z) {
      if (Z.row() != row(i)) continue;
      sum(row(i)) += Z.value() * L[k - begin];
      sum(row(k)) += Z.value() * L[i - begin];
      ++i;
    }
  }
  for (int k = begin; k < end; ++k) {
    const double Z = -std::exchange(sum(row(k)), 0.0);
    lower_.valuePtr()[k] = Z;
    diagonal_[column] -= L[k - begin] * Z;
  }
}

std::optional<double> SelectedInverse::operator()(int row, int column) const {
  const auto [j, i] = std::minmax(permuted_[row], permuted_[column]);
  if (i == j) return diagonal_[i];
  const int* begin = lower_.innerIndexPtr() + lower_.outerIndexPtr()[j];
  const int* end = lower_.innerIndexPtr() + lower_.outerIndexPtr()[j + 1];
  const int* found = std::lower_bound(begin, end, i);
  if (found == end || *found != i) return std::nullopt;
  return lower_.valuePtr()[found - lower_.innerIndexPtr()];
}

}  // namespace stereo_slam
