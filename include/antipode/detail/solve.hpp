// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <utility>

#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// A^-1 B by Gaussian elimination with partial pivoting, for small matrices. Compiles in a tenth of the time
/// of Eigen's blocked decomposition. Not finite if A is singular.
template <class Scalar, int N, int Cols>
[[nodiscard]] Matrix<Scalar, N, Cols> solve(Matrix<Scalar, N> A, Matrix<Scalar, N, Cols> B) {
  using std::abs;
  using std::swap;
  for (int k = 0; k < N; ++k) {
    int pivot = k;
    for (int i = k + 1; i < N; ++i) {
      if (abs(A(i, k)) > abs(A(pivot, k))) pivot = i;
    }
    if (pivot != k) {
      for (int j = 0; j < N; ++j) swap(A(k, j), A(pivot, j));
      for (int j = 0; j < Cols; ++j) swap(B(k, j), B(pivot, j));
    }
    for (int i = k + 1; i < N; ++i) {
      const Scalar factor = A(i, k) / A(k, k);
      for (int j = k + 1; j < N; ++j) A(i, j) -= factor * A(k, j);
      for (int j = 0; j < Cols; ++j) B(i, j) -= factor * B(k, j);
    }
  }
  for (int i = N - 1; i >= 0; --i) {
    for (int j = 0; j < Cols; ++j) {
      for (int k = i + 1; k < N; ++k) B(i, j) -= A(i, k) * B(k, j);
      B(i, j) /= A(i, i);
    }
  }
  return B;
}

}  // namespace antipode::detail
