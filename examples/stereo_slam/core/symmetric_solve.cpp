// SPDX-License-Identifier: MIT
#include "stereo_slam/core/symmetric_solve.hpp"

#include <Eigen/Cholesky>

// Eigen's factorisations take NaN for positive.
namespace stereo_slam {

double mahalanobis_squared(const Vector6<double>& e, const Matrix6<double>& S) {
  const Vector6<double> x = Eigen::LDLT<Matrix6<double>>(S).solve(e);
  return e.dot(x);
}

Matrix6<double> solve_symmetric(const Matrix6<double>& S, const Matrix6<double>& B) {
  return Eigen::LDLT<Matrix6<double>>(S).solve(B);
}

std::optional<Matrix6<double>> inverse_of_definite(const Matrix6<double>& A) {
  const Eigen::LLT<Matrix6<double>> factor(A);
  if (!A.allFinite() || factor.info() != Eigen::Success) return std::nullopt;
  return Matrix6<double>(factor.solve(Matrix6<double>(Matrix6<double>::Identity())));
}

std::optional<Matrix6<double>> whitening_matrix(const Matrix6<double>& P) {
  const Eigen::LLT<Matrix6<double>> root(P);
  if (!P.allFinite() || root.info() != Eigen::Success) return std::nullopt;
  return Matrix6<double>(root.matrixL().solve(Matrix6<double>(Matrix6<double>::Identity())));
}

}  // namespace stereo_slam
