// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// A measured vector with the covariance of its noise.
namespace antipode {

/// A measured vector and the covariance of its noise. Dim may be Eigen::Dynamic, and each measurement of a
/// list may then have another length.
template <std::floating_point Scalar, int Dim>
struct NoisyMeasurement {
  Vector<Scalar, Dim> z;  ///< what was measured
  Matrix<Scalar, Dim> R;  ///< covariance of its noise, in squared units of z
};

namespace detail {

/// Throws unless R has the size of z, which can differ for dynamic sizes only.
template <class Measurement>
void require_matching_size(const Measurement& m) {
  if (m.R.rows() != m.z.rows() || m.R.cols() != m.z.rows()) [[unlikely]] {
    throw_invalid("covariance of a measurement is not as large as the measurement", m.R);
  }
}

/// Whether every R is finite. Throws unless each has the size of its z and, if it is finite, is symmetric:
/// the updates read one of its triangles.
template <class Measurements>
[[nodiscard]] bool has_finite_noise(const Measurements& measurements) {
  bool finite = true;
  const std::size_t count = measurements.size();
  for (std::size_t i = 0; i < count; ++i) {
    using R = std::remove_cvref_t<decltype(measurements[i].R)>;
    require_matching_size(measurements[i]);
    if (!all_finite(measurements[i].R)) {
      finite = false;
      continue;
    }
    (void)checked_covariance<typename R::Scalar, R::RowsAtCompileTime>(
        "covariance of a measurement is not symmetric", measurements[i].R);
  }
  return finite;
}

/// A predicted measurement, or nothing. Throws if it has another length than the measured one.
template <class Z, class Predicted>
[[nodiscard]] std::optional<Z> checked_prediction(const Z& measured, Predicted&& predicted) {
  std::optional<Z> z(std::forward<Predicted>(predicted));
  if constexpr (Z::RowsAtCompileTime == Eigen::Dynamic) {
    if (z && z->rows() != measured.rows()) [[unlikely]] {
      throw_invalid("the model predicts another number of rows than were measured", z->rows());
    }
  }
  return z;
}

/// The Cholesky factors of the measurements' covariances. Throws unless every z is finite and every R
/// positive definite.
template <std::floating_point Scalar, int Dim>
[[nodiscard]] std::vector<Matrix<Scalar, Dim>> roots_of_noise(
    const std::vector<NoisyMeasurement<Scalar, Dim>>& measurements) {
  std::vector<Matrix<Scalar, Dim>> roots;
  roots.reserve(measurements.size());
  for (const auto& m : measurements) {
    require_matching_size(m);
    require_finite("measurement is not finite", m.z);
    const auto root = cholesky_factor<Scalar, Dim>(
        checked_covariance<Scalar, Dim>("covariance of a measurement is not finite or not symmetric", m.R));
    if (!root) [[unlikely]]
      throw_invalid("covariance of a measurement is not positive definite", m.R);
    roots.push_back(*root);
  }
  return roots;
}

}  // namespace detail

}  // namespace antipode
