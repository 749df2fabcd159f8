// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

using SparseMatrix = Eigen::SparseMatrix<double>;
using SparseFactor = Eigen::SimplicialLDLT<SparseMatrix, Eigen::Lower, Eigen::AMDOrdering<int>>;

/// The entries of the inverse of a sparse symmetric positive definite matrix that lie in the sparsity pattern
/// of its Cholesky factor. This pattern includes all non-zero entries of the matrix itself. For the
/// information matrix of a pose graph the entries include the covariances of all nodes. The computing time
/// depends on the size of the factor, not on that of the dense inverse. Source: K. Takahashi, J. Fagan and
/// M.-S. Chen, "Formation of a sparse bus impedance matrix and its application to short circuit study", PICA
/// 1973.
class SelectedInverse {
 public:
  /// Inverts the matrix P^T L D L^T P that the factor decomposes. The decomposition must have succeeded.
  explicit SelectedInverse(const SparseFactor& factor);

  /// Entry of the inverse; nothing if it is outside of the pattern.
  [[nodiscard]] std::optional<double> operator()(int row, int column) const;

 private:
  void compute_column(int column, std::vector<double>& sums);

  SparseMatrix lower_;  // L below its diagonal, then the inverse at the same places
  Eigen::VectorXd diagonal_;
  Eigen::VectorXi permuted_;  // row of the factor, for each row of the matrix
};

}  // namespace stereo_slam
