// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Jacobi>

#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// A = V diag(values) V^T with orthonormal columns of V and ascending values.
template <class Scalar, int N>
struct SymmetricEigen {
  Vector<Scalar, N> values;
  Matrix<Scalar, N> vectors;
};

/// The n with 2^(n-1) <= |entry| < 2^n for the largest entry of A, if that is too small or too large for
/// products of entries; otherwise 0.
template <class Scalar, int N>
[[nodiscard]] int exponent_out_of_range(const Matrix<Scalar, N>& A) {
  using std::abs;
  using std::sqrt;
  Scalar largest(0);
  for (int j = 0; j < N; ++j) {
    for (int i = 0; i < N; ++i) largest = std::max(largest, abs(A(i, j)));
  }
  const bool in_range = largest > sqrt(std::numeric_limits<Scalar>::min()) &&
                        largest < sqrt(std::numeric_limits<Scalar>::max());
  int exponent = 0;
  if (!in_range && std::isfinite(largest)) std::frexp(largest, &exponent);
  return exponent;
}

/// The eigenvalues and eigenvectors of a small symmetric matrix, by cyclic Jacobi rotations.
///
/// For positive definite matrices this keeps the small eigenvalues that a reduction to tridiagonal form
/// loses in the rounding errors of the large ones (Demmel and Veselic, "Jacobi's method is more accurate
/// than QR", 1992), and scatter matrices have eigenvalues from 1e-9 to 1. It also compiles much faster than
/// Eigen's solver.
template <class Scalar, int N>
[[nodiscard]] SymmetricEigen<Scalar, N> symmetric_eigen(Matrix<Scalar, N> A) {
  using std::abs;
  using std::sqrt;
  constexpr int kMaxSweeps = 30;  // it converges quadratically, in 4 to 8 sweeps
  constexpr Scalar kEpsilon = std::numeric_limits<Scalar>::epsilon();
  const int exponent = exponent_out_of_range<Scalar, N>(A);
  if (exponent != 0) {  // Eigen's rotation takes subnormal numbers as zero
    for (int j = 0; j < N; ++j) {
      for (int i = 0; i < N; ++i) A(i, j) = std::ldexp(A(i, j), -exponent);
    }
  }
  SymmetricEigen<Scalar, N> eigen;
  Matrix<Scalar, N>& V = eigen.vectors;
  V.setIdentity();
  bool diagonal = false;
  for (int sweep = 0; sweep < kMaxSweeps && !diagonal; ++sweep) {
    diagonal = true;
    for (int p = 0; p < N; ++p) {
      for (int q = p + 1; q < N; ++q) {
        if (abs(A(p, q)) <= kEpsilon * sqrt(abs(A(p, p))) * sqrt(abs(A(q, q)))) continue;
        diagonal = false;
        Eigen::JacobiRotation<Scalar> rotation;
        rotation.makeJacobi(A, p, q);
        A.applyOnTheLeft(p, q, rotation.adjoint());
        A.applyOnTheRight(p, q, rotation);
        V.applyOnTheRight(p, q, rotation);
        A(p, q) = A(q, p) = Scalar(0);
      }
    }
  }
  for (int i = 0; i < N; ++i) eigen.values[i] = exponent == 0 ? A(i, i) : std::ldexp(A(i, i), exponent);
  for (int i = 0; i < N; ++i) {
    int least = i;
    for (int k = i + 1; k < N; ++k) {
      if (eigen.values[k] < eigen.values[least]) least = k;
    }
    std::swap(eigen.values[i], eigen.values[least]);
    for (int row = 0; row < N; ++row) std::swap(V(row, i), V(row, least));
  }
  return eigen;
}

}  // namespace antipode::detail
