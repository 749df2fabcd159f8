// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/eigen_types.hpp>

/// Products of small matrices that recur. As functions of plain matrices they are compiled once a size;
/// nested Eigen expressions are types of their own wherever they occur, at a tenth of a second each.
namespace antipode::detail {

/// A diag(d) A^T, symmetric bit for bit.
template <class Scalar, int N, int K>
[[nodiscard]] Matrix<Scalar, N> scaled_square(const Matrix<Scalar, N, K>& A, const Vector<Scalar, K>& d) {
  Matrix<Scalar, N> square;
  for (int j = 0; j < N; ++j) {
    for (int i = j; i < N; ++i) {
      Scalar sum(0);
      for (int k = 0; k < K; ++k) sum += A(i, k) * A(j, k) * d[k];
      square(i, j) = square(j, i) = sum;
    }
  }
  return square;
}

/// A S A^T for a symmetric S, symmetric bit for bit.
template <class Scalar, int M, int N>
[[nodiscard]] Matrix<Scalar, M> congruence(const Matrix<Scalar, M, N>& A, const Matrix<Scalar, N>& S) {
  const Matrix<Scalar, M, N> AS = A * S;
  Matrix<Scalar, M> result;
  for (int j = 0; j < M; ++j) {
    for (int i = j; i < M; ++i) {
      Scalar sum(0);
      for (int k = 0; k < N; ++k) sum += AS(i, k) * A(j, k);
      result(i, j) = result(j, i) = sum;
    }
  }
  return result;
}

/// sum += weight a b^T.
template <class Scalar, int M, int N>
void add_outer_product(Scalar weight, const Vector<Scalar, M>& a, const Vector<Scalar, N>& b,
                       Matrix<Scalar, M, N>& sum) {
  for (int j = 0; j < N; ++j) {
    const Scalar scaled = weight * b[j];
    for (int i = 0; i < M; ++i) sum(i, j) += scaled * a[i];
  }
}

}  // namespace antipode::detail
