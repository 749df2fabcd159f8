// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// The x that minimises |A x - b|^2, for rows whose weights differ by any number of orders of magnitude.
///
/// By Householder reflections that take the longest column, in units of the columns of A, and its largest
/// entry first: then rounding changes every row by little compared with that row itself (Cox and Higham,
/// "Stability of Householder QR factorization for weighted least squares problems", 1998), and a row of
/// weight 1e-12 still decides what the others leave open. A^T A would lose it.
template <class Scalar, int Rows, int Cols>
struct LeastSquares {
  Vector<Scalar, Cols> x;       ///< not finite if A has not full rank
  Matrix<Scalar, Cols> root;    ///< root root^T = (A^T A)^-1
  Scalar squared_residual = 0;  ///< |A x - b|^2
  Scalar log_determinant = 0;   ///< log sqrt(det A^T A)

  LeastSquares(Matrix<Scalar, Rows, Cols> A, Vector<Scalar, Rows> b) {
    using std::log;
    Vector<Scalar, Cols> scale;
    std::array<int, static_cast<std::size_t>(Cols)> order;
    for (int j = 0; j < Cols; ++j) {
      scale[j] = length(A, 0, j);
      order[static_cast<std::size_t>(j)] = j;
    }
    for (int k = 0; k < Cols; ++k) {
      bring_largest_to(k, scale, order, A, b);
      reflect(k, A, b);
      log_determinant += log(std::abs(A(k, k)));
    }
    for (int i = Cols; i < Rows; ++i) squared_residual += b[i] * b[i];
    solve_upper(A, b, order);
  }

 private:
  /// The length of the column from the row on, without overflow.
  [[nodiscard]] static Scalar length(const Matrix<Scalar, Rows, Cols>& A, int row, int column) {
    Scalar largest(0), sum(0);
    for (int i = row; i < Rows; ++i) largest = std::max(largest, std::abs(A(i, column)));
    if (!(largest > Scalar(0))) return largest;
    for (int i = row; i < Rows; ++i) sum += (A(i, column) / largest) * (A(i, column) / largest);
    return largest * std::sqrt(sum);
  }

  template <class Order>
  static void bring_largest_to(int k, Vector<Scalar, Cols>& scale, Order& order,
                               Matrix<Scalar, Rows, Cols>& A, Vector<Scalar, Rows>& b) {
    int column = k, row = k;
    for (int j = k + 1; j < Cols; ++j) {
      if (length(A, k, j) / scale[j] > length(A, k, column) / scale[column]) column = j;
    }
    for (int i = k + 1; i < Rows; ++i) {
      if (std::abs(A(i, column)) > std::abs(A(row, column))) row = i;
    }
    std::swap(scale[k], scale[column]);
    std::swap(order[static_cast<std::size_t>(k)], order[static_cast<std::size_t>(column)]);
    for (int i = 0; i < Rows; ++i) std::swap(A(i, k), A(i, column));
    for (int j = 0; j < Cols; ++j) std::swap(A(k, j), A(row, j));
    std::swap(b[k], b[row]);
  }

  /// The Householder reflection that makes column k zero below its diagonal.
  static void reflect(int k, Matrix<Scalar, Rows, Cols>& A, Vector<Scalar, Rows>& b) {
    const Scalar diagonal = A(k, k) > Scalar(0) ? -length(A, k, k) : length(A, k, k);
    Vector<Scalar, Rows> v;  // (a - diagonal e) / diagonal; 2 / |v|^2 = -1 / v_k
    for (int i = k; i < Rows; ++i) v[i] = A(i, k) / diagonal;
    v[k] -= Scalar(1);
    const auto apply = [&](auto&& column) {
      Scalar sum(0);
      for (int i = k; i < Rows; ++i) sum += v[i] * column[i];
      sum /= v[k];
      for (int i = k; i < Rows; ++i) column[i] += sum * v[i];
    };
    for (int j = k + 1; j < Cols; ++j) apply(A.col(j));
    apply(b);
    A(k, k) = diagonal;
  }

  template <class Order>
  void solve_upper(const Matrix<Scalar, Rows, Cols>& R, const Vector<Scalar, Rows>& b, const Order& order) {
    // The columns of R^-1, and R^-1 b.
    Matrix<Scalar, Cols> inverse = Matrix<Scalar, Cols>::Zero();
    for (int j = 0; j < Cols; ++j) {
      inverse(j, j) = Scalar(1) / R(j, j);
      for (int i = j - 1; i >= 0; --i) {
        Scalar sum(0);
        for (int k = i + 1; k <= j; ++k) sum += R(i, k) * inverse(k, j);
        inverse(i, j) = -sum / R(i, i);
      }
    }
    for (int i = 0; i < Cols; ++i) {
      const int to = order[static_cast<std::size_t>(i)];
      x[to] = Scalar(0);
      for (int j = 0; j < Cols; ++j) {
        root(to, j) = inverse(i, j);
        x[to] += inverse(i, j) * b[j];
      }
    }
  }
};

}  // namespace antipode::detail
