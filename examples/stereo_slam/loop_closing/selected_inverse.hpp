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

/// The entries of the inverse of a sparse symmetric positive definite matrix that lie in the pattern of its
/// Cholesky factor, and so all that are not zero in the matrix. For the information matrix of a pose graph
/// these contain the covariances of all nodes. The time grows with the factor, not with the dense inverse.
/// Source: K. Takahashi, J. Fagan and M.-S. Chen, "Formation of a sparse bus impedance matrix and its
/// application to short circuit study", PICA 1973.
class SelectedInverse {
 public:
  /// Of the matrix P^T L D L^T P that the factor decomposes; its decomposition must have succeeded.
  explicit SelectedInverse(const SparseFactor& factor);

  /// Entry of the inverse; nothing if it is outside of the pattern.
  [[nodiscard]] std::optional<double> operator()(int row, int column) const;

 private:
  void compute_column(int column, std::vector<double>& sums);

  SparseMatrix lower_;  // L below its diagonal, then the inverse at the same places
  Eigen::VectorXd diagonal_;
  Eigen::VectorXi permuted_;  // place of a row in the factor
};

}  // namespace stereo_slam
