// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/eigen_types.hpp>

/// Frequent products of small matrices. As functions of plain matrices they are compiled once per size.
/// Nested Eigen expressions have a new type at every place, which costs a tenth of a second of compile time
/// each. Sizes may be Eigen::Dynamic.
namespace antipode::detail {

/// A diag(d) A^T, symmetric bit for bit.
template <class Scalar, int N, int K>
[[nodiscard]] Matrix<Scalar, N> scaled_square(const Matrix<Scalar, N, K>& A, const Vector<Scalar, K>& d) {
  const int n = static_cast<int>(A.rows()), columns = static_cast<int>(A.cols());
  Matrix<Scalar, N> square(n, n);
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < n; ++i) {
      Scalar sum(0);
      for (int k = 0; k < columns; ++k) sum += A(i, k) * A(j, k) * d[k];
      square(i, j) = square(j, i) = sum;
    }
  }
  return square;
}

/// A S A^T for a symmetric S, symmetric bit for bit.
template <class Scalar, int M, int N>
[[nodiscard]] Matrix<Scalar, M> congruence(const Matrix<Scalar, M, N>& A, const Matrix<Scalar, N>& S) {
  const int m = static_cast<int>(A.rows()), n = static_cast<int>(A.cols());
  const Matrix<Scalar, M, N> AS = A * S;
  Matrix<Scalar, M> result(m, m);
  for (int j = 0; j < m; ++j) {
    for (int i = j; i < m; ++i) {
      Scalar sum(0);
      for (int k = 0; k < n; ++k) sum += AS(i, k) * A(j, k);
      result(i, j) = result(j, i) = sum;
    }
  }
  return result;
}

/// sum += weight a b^T.
template <class Scalar, int M, int N>
void add_outer_product(Scalar weight, const Vector<Scalar, M>& a, const Vector<Scalar, N>& b,
                       Matrix<Scalar, M, N>& sum) {
  for (int j = 0; j < static_cast<int>(b.size()); ++j) {
    const Scalar scaled = weight * b[j];
    for (int i = 0; i < static_cast<int>(a.size()); ++i) sum(i, j) += scaled * a[i];
  }
}

}  // namespace antipode::detail
