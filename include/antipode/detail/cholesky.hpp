// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include <antipode/eigen_types.hpp>

/// Small positive definite matrices. The plain loops compile in a tenth of the time of Eigen's blocked
/// algorithms, which instantiate its matrix product kernels. N may be Eigen::Dynamic.
namespace antipode::detail {

/// The Cholesky factor L of A: lower triangular with a positive diagonal, L L^T = A. Nothing if A is not
/// positive definite. Only the lower triangle of A is read. Pivots below `smallest_pivot` are raised to it,
/// for matrices whose pivots only rounding can bring below a known bound.
template <class Scalar, int N>
[[nodiscard]] std::optional<Matrix<Scalar, N>> cholesky_factor(const Matrix<Scalar, N>& A,
                                                               Scalar smallest_pivot = Scalar(0)) {
  using std::sqrt;
  const int n = static_cast<int>(A.rows());
  Matrix<Scalar, N> L = Matrix<Scalar, N>::Zero(n, n);
  for (int j = 0; j < n; ++j) {
    Scalar pivot = A(j, j);
    for (int k = 0; k < j; ++k) pivot -= L(j, k) * L(j, k);
    pivot = std::max(pivot, smallest_pivot);
    if (!(pivot > Scalar(0))) return std::nullopt;
    L(j, j) = sqrt(pivot);
    for (int i = j + 1; i < n; ++i) {
      Scalar entry = A(i, j);
      for (int k = 0; k < j; ++k) entry -= L(i, k) * L(j, k);
      L(i, j) = entry / L(j, j);
    }
  }
  return L;
}

/// L^-1 B for a lower triangular L.
template <class Scalar, int N, int Cols>
[[nodiscard]] Matrix<Scalar, N, Cols> solve_lower(const Matrix<Scalar, N>& L, Matrix<Scalar, N, Cols> B) {
  const int n = static_cast<int>(L.rows()), columns = static_cast<int>(B.cols());
  for (int column = 0; column < columns; ++column) {
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < i; ++k) B(i, column) -= L(i, k) * B(k, column);
      B(i, column) /= L(i, i);
    }
  }
  return B;
}

/// L^-T B for a lower triangular L.
template <class Scalar, int N, int Cols>
[[nodiscard]] Matrix<Scalar, N, Cols> solve_lower_transposed(const Matrix<Scalar, N>& L,
                                                             Matrix<Scalar, N, Cols> B) {
  const int n = static_cast<int>(L.rows()), columns = static_cast<int>(B.cols());
  for (int column = 0; column < columns; ++column) {
    for (int i = n - 1; i >= 0; --i) {
      for (int k = i + 1; k < n; ++k) B(i, column) -= L(k, i) * B(k, column);
      B(i, column) /= L(i, i);
    }
  }
  return B;
}

/// A^-1 b for a positive definite A, by Gaussian elimination, which needs no pivoting for such an A.
template <class Scalar, int N>
[[nodiscard]] Vector<Scalar, N> solve_positive_definite(Matrix<Scalar, N> A, Vector<Scalar, N> b) {
  const int n = static_cast<int>(A.rows());
  for (int k = 0; k < n; ++k) {
    for (int i = k + 1; i < n; ++i) {
      const Scalar factor = A(i, k) / A(k, k);
      for (int j = k + 1; j < n; ++j) A(i, j) -= factor * A(k, j);
      b[i] -= factor * b[k];
    }
  }
  for (int i = n - 1; i >= 0; --i) {
    for (int j = i + 1; j < n; ++j) b[i] -= A(i, j) * b[j];
    b[i] /= A(i, i);
  }
  return b;
}

}  // namespace antipode::detail
