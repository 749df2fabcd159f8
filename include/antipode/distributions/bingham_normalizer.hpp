// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/detail/check.hpp>
#include <antipode/distributions/detail/bingham_contour.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// Normaliser of the Bingham density exp(sum_i z_i x_i^2) / N(z) on the unit sphere of R^Dim, 2 <= Dim <= 8,
/// and its first two derivatives, which are the moments of the density.
///
/// N is with respect to the surface measure of the whole sphere (2 pi^2 for Dim = 4). The z_i may come in any
/// order and with any shift: log N(z + c) = log N(z) + c. Computed in double for any scalar, to 1e-13
/// relative, at a cost that does not depend on z. Each function throws std::invalid_argument when a z_i is
/// not finite or when the z_i are more than kMaxConcentrationSpread apart.
namespace antipode {

/// How far apart the z_i may be.
inline constexpr double kMaxConcentrationSpread = 1e15;

/// The normaliser with its first derivatives.
template <class Scalar, int Dim>
struct BinghamNormalizer {
  Scalar log_normalizer;               ///< log N(z)
  Vector<Scalar, Dim> second_moments;  ///< E[x_i^2] = d log N / d z_i: positive, sum to one
};

/// The normaliser with its first and second derivatives.
template <class Scalar, int Dim>
struct BinghamNormalizerHessian : BinghamNormalizer<Scalar, Dim> {
  Matrix<Scalar, Dim> fourth_moments;  ///< E[x_i^2 x_j^2]

  /// d^2 log N / dz_i dz_j = E[x_i^2 x_j^2] - E[x_i^2] E[x_j^2].
  [[nodiscard]] Matrix<Scalar, Dim> hessian() const {
    return fourth_moments - this->second_moments * this->second_moments.transpose();
  }
};

namespace detail {

/// The largest z, after checking them all.
template <int Dim>
[[nodiscard]] double checked_max_concentration(const Vector<double, Dim>& z) {
  static_assert(Dim >= 2 && Dim <= 8, "the Bingham density is provided for 2 <= Dim <= 8");
  if (!z.allFinite() || !(z.maxCoeff() - z.minCoeff() <= kMaxConcentrationSpread)) [[unlikely]] {
    throw_invalid("Bingham concentrations are not finite or more than 1e15 apart", z);
  }
  return z.maxCoeff();
}

}  // namespace detail

/// log N(z).
template <std::floating_point Scalar, int Dim>
[[nodiscard]] Scalar bingham_log_normalizer(const Vector<Scalar, Dim>& z) {
  const Vector<double, Dim> z_double = z.template cast<double>();
  const double shift = detail::checked_max_concentration(z_double);
  const detail::BinghamContourSum<Dim> sum(z_double.array() - shift);
  return static_cast<Scalar>(shift + sum.log_normalizer());
}

/// log N(z) and its gradient.
template <std::floating_point Scalar, int Dim>
[[nodiscard]] BinghamNormalizer<Scalar, Dim> bingham_normalizer(const Vector<Scalar, Dim>& z) {
  const Vector<double, Dim> z_double = z.template cast<double>();
  const double shift = detail::checked_max_concentration(z_double);
  const detail::BinghamContourSum<Dim> sum(z_double.array() - shift);
  return {static_cast<Scalar>(shift + sum.log_normalizer()), sum.second_moments().template cast<Scalar>()};
}

/// log N(z), its gradient, and the fourth moments with the Hessian they give.
template <std::floating_point Scalar, int Dim>
[[nodiscard]] BinghamNormalizerHessian<Scalar, Dim> bingham_normalizer_hessian(const Vector<Scalar, Dim>& z) {
  const Vector<double, Dim> z_double = z.template cast<double>();
  const double shift = detail::checked_max_concentration(z_double);
  const detail::BinghamContourSum<Dim> sum(z_double.array() - shift);
  return {{static_cast<Scalar>(shift + sum.log_normalizer()), sum.second_moments().template cast<Scalar>()},
          sum.fourth_moments().template cast<Scalar>()};
}

}  // namespace antipode
