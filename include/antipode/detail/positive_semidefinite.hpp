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

/// Largest relative asymmetry, and largest negative eigenvalue of a covariance with unit variances, that
/// count as rounding errors: 1e-9, or 32 epsilon of the scalar type if that is larger.
template <class Scalar>
inline constexpr Scalar kSymmetryTolerance = std::max(Scalar(1e-9),
                                                      Scalar(32) * std::numeric_limits<Scalar>::epsilon());

/// The size of a matrix that its rounding errors are compared with: `size`, but not less than the square of
/// 64 epsilon. Poses are rounded to some epsilon, so that an exactly known one comes back with variances of
/// about this size, of either sign.
template <class Scalar>
[[nodiscard]] Scalar rounding_scale(Scalar size) {
  constexpr Scalar kRounding = Scalar(64) * std::numeric_limits<Scalar>::epsilon();
  return std::max(size, kRounding * kRounding);
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

/// For every coordinate of a covariance the variance that its rounding errors are compared with: the largest
/// of its own triple. Three consecutive coordinates have one unit, as those of a rotation, a position or a
/// velocity; a variance in m^2 must not excuse an error in rad^2.
template <class Scalar, int N>
[[nodiscard]] Vector<Scalar, N> largest_of_triples(const Matrix<Scalar, N>& A) {
  using std::abs;
  const int n = static_cast<int>(A.rows());
  Vector<Scalar, N> largest(n);
  for (int first = 0; first < n; first += 3) {
    Scalar variance(0);
    for (int i = first; i < std::min(first + 3, n); ++i) variance = std::max(variance, abs(A(i, i)));
    for (int i = first; i < std::min(first + 3, n); ++i) largest[i] = rounding_scale(variance);
  }
  return largest;
}

/// (A + A^T)/2 for a covariance, whose coordinates may have different units. Throws unless A is finite and
/// symmetric within kSymmetryTolerance of the units of every entry.
template <class Scalar, int N>
[[nodiscard]] Matrix<Scalar, N> checked_covariance(std::string_view what, const Matrix<Scalar, N>& A) {
  using std::abs;
  using std::sqrt;
  Matrix<Scalar, N> symmetric = checked_symmetric<Scalar, N>(what, A);
  const Vector<Scalar, N> largest = largest_of_triples<Scalar, N>(symmetric);
  for (int j = 0; j < static_cast<int>(A.rows()); ++j) {
    for (int i = j + 1; i < static_cast<int>(A.rows()); ++i) {
      const Scalar allowed = kSymmetryTolerance<Scalar> * sqrt(largest[i]) * sqrt(largest[j]);
      if (!(abs(A(i, j) - A(j, i)) <= allowed)) [[unlikely]] {
        throw_invalid(what, A);
      }
    }
  }
  return symmetric;
}

/// Throws unless A is finite and symmetric as checked_covariance() demands. For functions that use A as it
/// is: a matrix that is symmetric bit for bit, as most are, takes a subtraction for every pair of entries.
template <class Scalar, int N>
void require_covariance(std::string_view what, const Matrix<Scalar, N>& A) {
  bool symmetric = true;
  for (int j = 0; j < static_cast<int>(A.rows()); ++j) {
    // NaN for entries that are not finite, on the diagonal too.
    for (int i = j; i < static_cast<int>(A.rows()); ++i) symmetric &= A(i, j) - A(j, i) == Scalar(0);
  }
  if (!symmetric) [[unlikely]]
    (void)checked_covariance<Scalar, N>(what, A);
}

/// A root of a positive semidefinite matrix, L L^T = A, and whether A is regular.
template <class Scalar, int N>
struct RootOfCovariance {
  Matrix<Scalar, N> L;  ///< lower triangular if A is positive definite
  bool positive_definite;
};

/// A covariance as D C D with a diagonal D, so that neither the units nor the sizes of the variances matter
/// to the eigenvalues of C: its diagonal is one, or less where a variance is so small beside the others of
/// its triple that rounding errors of 32 epsilon of these would exceed kSymmetryTolerance.
template <class Scalar, int N>
struct ScaledEigen {
  Vector<Scalar, N> deviations;     ///< D
  SymmetricEigen<Scalar, N> eigen;  ///< of C

  explicit ScaledEigen(const Matrix<Scalar, N>& A) : deviations(largest_of_triples<Scalar, N>(A)) {
    using std::sqrt;
    constexpr Scalar kSmallest =
        Scalar(32) * std::numeric_limits<Scalar>::epsilon() / kSymmetryTolerance<Scalar>;
    Matrix<Scalar, N> C;
    for (int i = 0; i < N; ++i) deviations[i] = sqrt(std::max(A(i, i), kSmallest * deviations[i]));
    for (int j = 0; j < N; ++j) {
      for (int i = 0; i < N; ++i) C(i, j) = A(i, j) / deviations[i] / deviations[j];
    }
    eigen = symmetric_eigen<Scalar, N>(C);
  }

  /// D V sqrt(lambda), with negative eigenvalues taken as zero.
  [[nodiscard]] Matrix<Scalar, N> root() const {
    using std::sqrt;
    Matrix<Scalar, N> L = eigen.vectors;
    for (int j = 0; j < N; ++j) {
      const Scalar sigma = sqrt(std::max(eigen.values[j], Scalar(0)));
      for (int i = 0; i < N; ++i) L(i, j) *= deviations[i] * sigma;
    }
    return L;
  }
};

/// The Cholesky factor of A, or D V sqrt(lambda) of its scaled eigendecomposition if A is singular. Throws if
/// an eigenvalue or a variance is more negative than rounding errors explain, whatever the units.
template <class Scalar, int N>
[[nodiscard]] RootOfCovariance<Scalar, N> root_of_covariance(std::string_view what,
                                                             const Matrix<Scalar, N>& A) {
  if (const auto L = cholesky_factor(A)) [[likely]] {
    return {*L, true};
  }
  const ScaledEigen<Scalar, N> scaled(A);
  if (!(scaled.eigen.values[0] >= -kSymmetryTolerance<Scalar> * Scalar(N))) [[unlikely]] {
    throw_invalid(what, A);
  }
  return {scaled.root(), false};
}

/// A covariance without the negative eigenvalues that rounding has left.
template <class Scalar, int N>
[[nodiscard]] Matrix<Scalar, N> without_rounding(const Matrix<Scalar, N>& A) {
  if (cholesky_factor(A)) return A;
  const Matrix<Scalar, N> L = ScaledEigen<Scalar, N>(A).root();
  return scaled_square<Scalar, N, N>(L, Vector<Scalar, N>::Ones());
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
