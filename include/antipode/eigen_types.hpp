// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

/// Fixed-size Eigen aliases used throughout the library. Poses are perturbed in R^6 with the rotation first.
namespace antipode {

template <class Scalar, int Rows>
using Vector = Eigen::Matrix<Scalar, Rows, 1>;
template <class Scalar, int Rows, int Cols = Rows>
using Matrix = Eigen::Matrix<Scalar, Rows, Cols>;

template <class Scalar>
using Vector2 = Vector<Scalar, 2>;
template <class Scalar>
using Vector3 = Vector<Scalar, 3>;
template <class Scalar>
using Vector4 = Vector<Scalar, 4>;
template <class Scalar>
using Vector6 = Vector<Scalar, 6>;
template <class Scalar>
using Vector8 = Vector<Scalar, 8>;

template <class Scalar>
using Matrix2 = Matrix<Scalar, 2>;
template <class Scalar>
using Matrix3 = Matrix<Scalar, 3>;
template <class Scalar>
using Matrix4 = Matrix<Scalar, 4>;
template <class Scalar>
using Matrix6 = Matrix<Scalar, 6>;
template <class Scalar>
using Matrix8 = Matrix<Scalar, 8>;

}  // namespace antipode
