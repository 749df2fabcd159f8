// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <limits>
#include <string_view>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <antipode/detail/check.hpp>
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
  const Eigen::SelfAdjointEigenSolver<Matrix<Scalar, N>> eigen(A);
  if (!(eigen.eigenvalues()[0] >= -kSymmetryTolerance<Scalar> * A.trace())) [[unlikely]] {
    throw_invalid(what, A);
  }
  const Vector<Scalar, N> root = eigen.eigenvalues().cwiseMax(Scalar(0)).cwiseSqrt();
  return {eigen.eigenvectors() * root.asDiagonal(), false};
}

/// A with the negative eigenvalues, which come from rounding, set to zero.
template <class Scalar, int N>
[[nodiscard]] Matrix<Scalar, N> without_negative_eigenvalues(const Matrix<Scalar, N>& A) {
  const Eigen::SelfAdjointEigenSolver<Matrix<Scalar, N>> eigen(A);
  if (eigen.eigenvalues()[0] >= Scalar(0)) return A;
  const Vector<Scalar, N> lambda = eigen.eigenvalues().cwiseMax(Scalar(0));
  return eigen.eigenvectors() * lambda.asDiagonal() * eigen.eigenvectors().transpose();
}

/// The inverse of a positive semidefinite matrix on its range.
template <class Scalar>
[[nodiscard]] Matrix3<Scalar> pseudo_inverse(const Matrix3<Scalar>& A) {
  constexpr Scalar kReciprocalCondition = std::max(Scalar(1e-12), std::numeric_limits<Scalar>::epsilon());
  const Eigen::SelfAdjointEigenSolver<Matrix3<Scalar>> eigen(A);
  const Vector3<Scalar>& lambda = eigen.eigenvalues();
  const Vector3<Scalar> inverse =
      (lambda.array() > kReciprocalCondition * lambda[2]).select(lambda.cwiseInverse(), Scalar(0));
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace antipode::detail
