// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/eigen_types.hpp>

namespace antipode {

/// A measured vector and the covariance of its noise.
template <std::floating_point Scalar, int Dim>
struct NoisyMeasurement {
  Vector<Scalar, Dim> z;
  Matrix<Scalar, Dim> R;
};

}  // namespace antipode
