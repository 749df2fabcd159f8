// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

/// @file
/// Aliases of Eigen's vectors and matrices. Vectors of R^6 that perturb a pose have the rotation first.
namespace antipode {

/// A column vector of `Rows` entries.
template <class Scalar, int Rows>
using Vector = Eigen::Matrix<Scalar, Rows, 1>;
/// A matrix of `Rows` x `Cols` entries; square by default.
template <class Scalar, int Rows, int Cols = Rows>
using Matrix = Eigen::Matrix<Scalar, Rows, Cols>;

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
