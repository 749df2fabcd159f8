// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <limits>
#include <string_view>

#include <Eigen/Cholesky>

#include <antipode/detail/check.hpp>
#include <antipode/distributions/detail/symmetric_eigen.hpp>
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
  const Scalar asymmetry = (A - A.transpose()).cwiseAbs().maxCoeff();
  if (!A.allFinite() || !(asymmetry <= kSymmetryTolerance<Scalar> * A.cwiseAbs().maxCoeff())) [[unlikely]] {
    throw_invalid(what, A);
  }
  return Scalar(0.5) * (A + A.transpose());
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
  const Eigen::LLT<Matrix<Scalar, N>> cholesky(A);
  if (cholesky.info() == Eigen::Success) [[likely]] {
    return {cholesky.matrixL(), true};
  }
  const SymmetricEigen<Scalar, N> eigen = symmetric_eigen(A);
  if (!(eigen.values[0] >= -kSymmetryTolerance<Scalar> * A.trace())) [[unlikely]] {
    throw_invalid(what, A);
  }
  const Vector<Scalar, N> root = eigen.values.cwiseMax(Scalar(0)).cwiseSqrt();
  return {eigen.vectors * root.asDiagonal(), false};
}

/// A with the negative eigenvalues, which come from rounding, set to zero.
template <class Scalar, int N>
[[nodiscard]] Matrix<Scalar, N> without_negative_eigenvalues(const Matrix<Scalar, N>& A) {
  const SymmetricEigen<Scalar, N> eigen = symmetric_eigen(A);
  if (eigen.values[0] >= Scalar(0)) return A;
  const Vector<Scalar, N> lambda = eigen.values.cwiseMax(Scalar(0));
  return eigen.vectors * lambda.asDiagonal() * eigen.vectors.transpose();
}

/// The inverse of a positive semidefinite matrix on its range.
template <class Scalar>
[[nodiscard]] Matrix3<Scalar> pseudo_inverse(const Matrix3<Scalar>& A) {
  constexpr Scalar kReciprocalCondition = std::max(Scalar(1e-12), std::numeric_limits<Scalar>::epsilon());
  const SymmetricEigen<Scalar, 3> eigen = symmetric_eigen(A);
  const Vector3<Scalar>& lambda = eigen.values;
  const Vector3<Scalar> inverse =
      (lambda.array() > kReciprocalCondition * lambda[2]).select(lambda.cwiseInverse(), Scalar(0));
  return eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();
}

}  // namespace antipode::detail
