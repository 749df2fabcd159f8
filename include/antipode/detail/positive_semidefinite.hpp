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

/// Largest relative asymmetry, and largest negative eigenvalue relative to the trace, that count as rounding
/// errors: 1e-9, or 32 epsilon of the scalar type if that is larger.
template <class Scalar>
inline constexpr Scalar kSymmetryTolerance = std::max(Scalar(1e-9),
                                                      Scalar(32) * std::numeric_limits<Scalar>::epsilon());

/// The size of a matrix that its rounding errors are compared with: `size`, but not less than the smallest
/// normal number. The entries of smaller matrices are rounded to multiples of a fixed number.
template <class Scalar>
[[nodiscard]] Scalar rounding_scale(Scalar size) {
  return std::max(size, std::numeric_limits<Scalar>::min());
}

/// (A + A^T)/2. Throws unless A is finite and symmetric within kSymmetryTolerance.
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
  if (!all_finite(A) || !(asymmetry <= kSymmetryTolerance<Scalar> * rounding_scale(largest))) [[unlikely]] {
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

/// The Cholesky factor of A, or V sqrt(lambda) of its eigendecomposition if A is singular. Throws if an
/// eigenvalue or a variance is more negative than rounding errors explain.
template <class Scalar, int N>
[[nodiscard]] RootOfCovariance<Scalar, N> root_of_covariance(std::string_view what,
                                                             const Matrix<Scalar, N>& A) {
  using std::sqrt;
  if (const auto L = cholesky_factor(A)) [[likely]] {
    return {*L, true};
  }
  const SymmetricEigen<Scalar, N> eigen = symmetric_eigen(A);
  // A negative variance in rad^2 may be small beside a trace that variances in m^2 dominate, and yet be no
  // rounding error.
  const Scalar smallest_variance = A.diagonal().minCoeff();
  constexpr Scalar kRounding = Scalar(32) * std::numeric_limits<Scalar>::epsilon();
  const Scalar scale = rounding_scale(A.trace());
  if (!(eigen.values[0] >= -kSymmetryTolerance<Scalar> * scale) || smallest_variance < -kRounding * scale)
      [[unlikely]] {
    throw_invalid(what, A);
  }
  Matrix<Scalar, N> root = eigen.vectors;
  for (int j = 0; j < N; ++j) {
    const Scalar sigma = sqrt(std::max(eigen.values[j], Scalar(0)));
    for (int i = 0; i < N; ++i) root(i, j) *= sigma;
  }
  return {root, false};
}

/// A with its negative eigenvalues set to zero.
template <class Scalar, int N>
[[nodiscard]] Matrix<Scalar, N> without_negative_eigenvalues(const Matrix<Scalar, N>& A) {
  if (cholesky_factor(A)) return A;  // the common case, at a tenth of the cost of the eigenvalues
  const SymmetricEigen<Scalar, N> eigen = symmetric_eigen(A);
  if (eigen.values[0] >= Scalar(0)) return A;
  Vector<Scalar, N> lambda = eigen.values;
  for (int i = 0; i < N; ++i) lambda[i] = std::max(lambda[i], Scalar(0));
  return scaled_square<Scalar, N, N>(eigen.vectors, lambda);
}

/// The pseudo-inverse of a positive semidefinite matrix. Eigenvalues below 1e-12 (epsilon, if larger) of the
/// largest one count as zero.
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
