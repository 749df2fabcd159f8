// SPDX-License-Identifier: MIT
#pragma once

// With these flags the library would not compile, or a compiler may take every number for finite: NaN in a
// covariance would then pass all checks, and a filter report that it has converged.
#if __cplusplus < 202002L
#error \
    "antipode needs C++20: compile with -std=c++20 (CMake: target_compile_features(app PRIVATE cxx_std_20))"
#endif
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "antipode needs NaN and infinity: compile without -ffast-math and -Ofast, or add -fno-finite-math-only"
#endif
#if !defined(__cpp_exceptions)
#error "antipode reports invalid arguments by exceptions: compile without -fno-exceptions"
#endif

#include <Eigen/Core>

#if !EIGEN_VERSION_AT_LEAST(3, 4, 0)
#error "antipode needs Eigen 3.4 or later: another Eigen comes first among the include folders"
#endif

/// @file
/// Aliases of Eigen's vectors and matrices. Vectors of R^6 that perturb a pose have the rotation first.
namespace antipode {

/// A column vector of `Rows` entries.
template <class Scalar, int Rows>
using Vector = Eigen::Matrix<Scalar, Rows, 1>;
/// A matrix of `Rows` x `Cols` entries, square by default. Its numbers are stored column by column, also with
/// EIGEN_DEFAULT_TO_ROW_MAJOR.
template <class Scalar, int Rows, int Cols = Rows>
using Matrix = Eigen::Matrix<Scalar, Rows, Cols, Rows == 1 && Cols != 1 ? Eigen::RowMajor : Eigen::ColMajor>;

template <class Scalar>
using Vector2 = Vector<Scalar, 2>;  ///< a column of 2 entries
template <class Scalar>
using Vector3 = Vector<Scalar, 3>;  ///< a column of 3 entries
template <class Scalar>
using Vector4 = Vector<Scalar, 4>;  ///< a column of 4 entries
template <class Scalar>
using Vector6 = Vector<Scalar, 6>;  ///< a column of 6 entries
template <class Scalar>
using Vector8 = Vector<Scalar, 8>;  ///< a column of 8 entries

template <class Scalar>
using Matrix2 = Matrix<Scalar, 2>;  ///< 2 x 2 entries
template <class Scalar>
using Matrix3 = Matrix<Scalar, 3>;  ///< 3 x 3 entries
template <class Scalar>
using Matrix4 = Matrix<Scalar, 4>;  ///< 4 x 4 entries
template <class Scalar>
using Matrix6 = Matrix<Scalar, 6>;  ///< 6 x 6 entries
template <class Scalar>
using Matrix8 = Matrix<Scalar, 8>;  ///< 8 x 8 entries

}  // namespace antipode
