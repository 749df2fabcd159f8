// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <vector>

#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/eigen_types.hpp>

namespace antipode {

/// A measured vector and the covariance of its noise.
template <std::floating_point Scalar, int Dim>
struct NoisyMeasurement {
  Vector<Scalar, Dim> z;
  Matrix<Scalar, Dim> R;
};

namespace detail {

/// The Cholesky factors of the measurements' covariances. Throws unless every z is finite and every R
/// positive definite.
template <std::floating_point Scalar, int Dim>
[[nodiscard]] std::vector<Matrix<Scalar, Dim>> roots_of_noise(
    const std::vector<NoisyMeasurement<Scalar, Dim>>& measurements) {
  std::vector<Matrix<Scalar, Dim>> roots;
  roots.reserve(measurements.size());
  for (const auto& m : measurements) {
    require_finite("measurement is not finite", m.z);
    const auto root = cholesky_factor<Scalar, Dim>(
        checked_symmetric<Scalar, Dim>("covariance of a measurement is not finite or not symmetric", m.R));
    if (!root) [[unlikely]]
      throw_invalid("covariance of a measurement is not positive definite", m.R);
    roots.push_back(*root);
  }
  return roots;
}

}  // namespace detail

}  // namespace antipode
