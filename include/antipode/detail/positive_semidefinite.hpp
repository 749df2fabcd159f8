// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// Relative asymmetry, and negative eigenvalue relative to the trace, that pass for rounding: 1e-9, or what
/// the scalar type can hold.
template <class Scalar>
inline constexpr Scalar kSymmetryTolerance = std::max(Scalar(1e-9),
                                                      Scalar(32) * std::numeric_limits<Scalar>::epsilon());

/// (A + A^T)/2. Throws unless A is finite and symmetric.
template <class Scalar, int N>
[[nodiscard]] Matrix<Scalar, N> checked_symmetric(std::string_view what, const Matrix<Scalar, N>& A) {
  using std::abs;
  const int n = static_cast<int>(A.rows());
  Matrix<Scalar, N> symmetric(n, n);
  Scalar asymmetry(0), largest(0);
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < n; ++i) {
      symmetric(i, j) = symmetric(j, i) = Scalar(0.5) * A(i, j) + Scalar(0.5) * A(j, i);  // no overflow
      asymmetry = std::max(asymmetry, abs(A(i, j) - A(j, i)));
      largest = std::max(largest, abs(symmetric(i, j)));
    }
  }
  if (!all_finite(A) || !(asymmetry <= kSymmetryTolerance<Scalar> * largest)) [[unlikely]] {
    throw_invalid(what, A);
  }
  return symmetric;
}

/// A root of a positive semidefinite matrix, L L^T = A, and whether A is regular.
template <class Scalar, int N>
struct RootOfCovariance {
  Matrix<Scalar, N> L;  ///< lower triangular if A is positive definite
  bool positive_definite;
};

/// The Cholesky factor, or V sqrt(lambda) where A is singular. Throws if A has a truly negative eigenvalue.
template <class Scalar, int N>
[[nodiscard]] RootOfCovariance<Scalar, N> root_of_covariance(std::string_view what,
                                                             const Matrix<Scalar, N>& A) {
  using std::sqrt;
  if (const auto L = cholesky_factor(A)) [[likely]] {
    return {*L, true};
  }
  const SymmetricEigen<Scalar, N> eigen = symmetric_eigen(A);
  // A small negative variance beside large ones of another unit, rad^2 beside m^2, is not rounding.
  const Scalar smallest_variance = A.diagonal().minCoeff();
  constexpr Scalar kRounding = Scalar(32) * std::numeric_limits<Scalar>::epsilon();
  if (!(eigen.values[0] >= -kSymmetryTolerance<Scalar> * A.trace()) ||
      smallest_variance < -kRounding * A.trace()) [[unlikely]] {
    throw_invalid(what, A);
  }
  Matrix<Scalar, N> root = eigen.vectors;
  for (int j = 0; j < N; ++j) {
    const Scalar sigma = sqrt(std::max(eigen.values[j], Scalar(0)));
    for (int i = 0; i < N; ++i) root(i, j) *= sigma;
  }
  return {root, false};
}

/// A with the negative eigenvalues, which come from rounding, set to zero.
template <class Scalar, int N>
[[nodiscard]] Matrix<Scalar, N> without_negative_eigenvalues(const Matrix<Scalar, N>& A) {
  if (cholesky_factor(A)) return A;  // the common case, at a tenth of the cost of the eigenvalues
  const SymmetricEigen<Scalar, N> eigen = symmetric_eigen(A);
  if (eigen.values[0] >= Scalar(0)) return A;
  Vector<Scalar, N> lambda = eigen.values;
  for (int i = 0; i < N; ++i) lambda[i] = std::max(lambda[i], Scalar(0));
  return scaled_square<Scalar, N, N>(eigen.vectors, lambda);
}

/// The inverse of a positive semidefinite matrix on its range.
template <class Scalar>
[[nodiscard]] Matrix3<Scalar> pseudo_inverse(const Matrix3<Scalar>& A) {
  constexpr Scalar kReciprocalCondition = std::max(Scalar(1e-12), std::numeric_limits<Scalar>::epsilon());
  const SymmetricEigen<Scalar, 3> eigen = symmetric_eigen(A);
  Vector3<Scalar> inverse;
  for (int i = 0; i < 3; ++i) {
    const Scalar lambda = eigen.values[i];
    const bool regular =
        lambda > kReciprocalCondition * eigen.values[2] && lambda > std::numeric_limits<Scalar>::min();
    inverse[i] = regular ? Scalar(1) / lambda : Scalar(0);
  }
  return scaled_square<Scalar, 3, 3>(eigen.vectors, inverse);
}

}  // namespace antipode::detail
